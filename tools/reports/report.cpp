#include "tools/reports/report.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "tools/files/output_file.hpp"
#include "tools/files/text_file.hpp"
#include "tools/files/user_error.hpp"
#include "tools/reports/answers.hpp"
#include "tools/reports/conditions.hpp"
#include "tools/reports/json_text.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/report_tables.hpp"
#include "tools/reports/schema.hpp"
#include "tools/reports/text_layout.hpp"

namespace cli {
namespace {

namespace fs = std::filesystem;

Picture read_picture(const std::string& file, bool png) {
  Picture picture{file, png ? "image/png" : "image/svg+xml", read_text_file(file, most_data_bytes, true)};
  if (png && !picture.bytes.starts_with("\x89PNG\r\n\x1A\n"))
    throw UserError(file + ": not a PNG picture, though its name ends in .png");
  if (!png && picture.bytes.find("<svg") == std::string::npos)
    throw UserError(file + ": not an SVG picture, though its name ends in .svg");
  return picture;
}

std::string without_ending(const std::string& file) { return fs::path(file).replace_extension().string(); }

std::vector<const Measurement*> all_of(const ReportInput& input) {
  std::vector<const Measurement*> all;
  for (const auto* kind : {&input.capacity, &input.accuracy, &input.stability}) {
    for (const Measurement& m : *kind) all.push_back(&m);
  }
  return all;
}

// Result of `make`, or one line about what the report lacks: a row may need what others do without.
template <typename Make>
auto complete(const Measurement& m, Make make) {
  try {
    return make();
  } catch (const Json::exception&) {
    throw UserError(fmt::format("{}: not a complete {} report: a value is missing or of another kind", m.file,
                                m.json.value("schema", "")));
  }
}

// One column per machine and build; more than one is worth a warning.
void add_machine(HtmlPage& page, const ReportInput& input) {
  static const std::pair<const char*, const char*> fields[] = {{"cpu", "CPU"},
                                                               {"cores", "cores"},
                                                               {"version", "bristle"},
                                                               {"commit", "commit"},
                                                               {"flags", "compiler, flags"}};
  struct Build {
    std::vector<std::string> values;
    std::set<std::string> isas, hashes;
    std::vector<std::string> reports;
  };
  std::vector<Build> builds;
  bool quick = false, changed = false;
  for (const Measurement* m : all_of(input)) {
    complete(*m, [&] {
      const Json& c = m->json.at("conditions");
      std::vector<std::string> values;
      for (const auto& [key, name] : fields)
        values.push_back(c.at(key).is_string() ? text_of(c, key) : number_text(c.at(key)));
      auto build =
          std::find_if(builds.begin(), builds.end(), [&](const Build& b) { return b.values == values; });
      if (build == builds.end()) build = builds.insert(build, Build{values, {}, {}, {}});
      if (c.contains("isa")) build->isas.insert(c.at("isa").get<std::string>());
      if (m->json.contains("state_hash")) build->hashes.insert(m->json.at("state_hash").get<std::string>());
      build->reports.push_back(fs::path(m->file).filename().string() +
                               (c.contains("time") ? ", " + c.at("time").get<std::string>() : ""));
      quick = quick || m->json.at("quick").get<bool>();
      changed = changed || values[3].ends_with("-dirty");
    });
  }
  std::vector<std::string> headers = {"<"};
  headers.insert(headers.end(), builds.size(), "<");
  Table table(headers);
  const auto row = [&](const char* name, auto value) {
    std::vector<Cell> cells = {name};
    for (const Build& build : builds) cells.push_back(value(build));
    table.add(std::move(cells));
  };
  const auto joined = [](const auto& texts) {
    std::string out;
    for (const std::string& text : texts) out += (out.empty() ? "" : "; ") + text;
    return out.empty() ? std::string("-") : out;
  };
  for (std::size_t f = 0; f < std::size(fields); ++f)
    row(fields[f].second, [&](const Build& b) { return b.values[f]; });
  row("instruction set", [&](const Build& b) { return joined(b.isas); });
  row("state hash of a fixed scene", [&](const Build& b) { return joined(b.hashes); });
  row("measured", [&](const Build& b) { return joined(b.reports); });
  page.table(table);
  if (builds.size() > 1)
    page.warning(
        "These reports come from different machines or builds: compare figures within a column only.");
  if (changed)
    page.warning(
        "The sources had changes that are in no commit (-dirty): the commit alone cannot give these "
        "figures again.");
  if (quick) page.warning("Measured with --quick: fewer rows, shorter runs, coarser figures.");
}

void add_how_to_read(HtmlPage& page) {
  page.list(
      {"A bristle stands for some of the tiny springs of a contact. More of them make the force smoother and "
       "truer, and the step dearer: that is the trade this page measures.",
       "Capacity: how many bristles end their step inside the deadline. 99 of 100 steps had to. Times depend "
       "on the machine and on what else ran; ratios taken in one run hold better.",
       "Error against run time: choose the error you can live with, take the setting recommended for it. "
       "People notice differences of force from 7 to 10 % up; below the error of the reference no figure "
       "means "
       "anything.",
       "Slopes: -1/2 means four times the bristles halve the error; 1 means half the step halves it.",
       "Stability: blue settles. Where colour and line part, the table says why. k = K T²/m is how stiff the "
       "contact is for the step: an explicit loop needs it small, the couplings of the library do not.",
       "The same inputs give the same state hash on every machine; another hash means another computation."});
}

void add_other_pictures(HtmlPage& page, const std::vector<Picture>& pictures) {
  for (const Picture& picture : pictures) {
    const std::string name = fs::path(picture.file).stem().string();
    page.picture(picture.bytes, picture.media_type,
                 name == "long_motion"
                     ? "Time per bristle against the length of a step: bristles that snap many "
                       "times in a step cost a bounded time."
                 : name == "presliding" ? "Time of a step against its length in presliding, and the share of "
                                          "bristles that are looked at: what holds still costs nothing."
                                        : name);
  }
}

void add_summary(HtmlPage& page, const ReportInput& input) {
  std::vector<std::string> lines;
  const auto summarise = [&](const std::vector<Measurement>& kind, auto summary) {
    for (const Measurement& m : kind) {
      for (std::string& line : complete(m, [&] { return summary(m.json); })) lines.push_back(std::move(line));
    }
  };
  summarise(input.capacity, capacity_summary);
  summarise(input.accuracy, accuracy_summary);
  summarise(input.stability, stability_summary);
  page.list(lines);
}

}  // namespace

ReportInput read_report_input(const std::vector<std::string>& files) {
  ReportInput input;
  for (const std::string& file : files) {
    const std::string ending = fs::path(file).extension().string();
    if (ending == ".png" || ending == ".svg") {
      input.pictures.push_back(read_picture(file, ending == ".png"));
      continue;
    }
    Json json = parse_json(read_text_file(file), file);
    const std::string schema =
        json.is_object() && json.contains("schema") && json["schema"].is_string() ? json["schema"] : Json("");
    auto* const kind = schema == "bristle-capacity-1"    ? &input.capacity
                       : schema == "bristle-accuracy-1"  ? &input.accuracy
                       : schema == "bristle-stability-1" ? &input.stability
                                                         : nullptr;
    if (!kind)
      throw UserError(fmt::format(
          "{}: schema is '{}'; allowed: bristle-capacity-1, bristle-accuracy-1, bristle-stability-1", file,
          schema));
    check_report(json, schema, file);
    kind->push_back({file, std::move(json), {}});
  }
  for (auto* kind : {&input.capacity, &input.accuracy, &input.stability}) {
    for (Measurement& m : *kind) {
      const auto theirs = std::stable_partition(
          input.pictures.begin(), input.pictures.end(),
          [&](const Picture& p) { return without_ending(p.file) != without_ending(m.file); });
      m.pictures.assign(theirs, input.pictures.end());
      input.pictures.erase(theirs, input.pictures.end());
    }
  }
  if (all_of(input).empty())
    throw UserError("no JSON report among the files; there must be one of capacity, accuracy or stability");
  return input;
}

std::vector<Answer> report_answers(const ReportInput& input) {
  Answer fast{"How wrong is a fast setting?", {}}, choice{"What to choose?", {}},
      stable{"Is mine stable?", {}}, leave{"What to leave out?", {}};
  for (const Measurement& m : input.accuracy) {
    complete(m, [&] {
      const std::string scene =
          input.accuracy.size() > 1 ? text_of(m.json.at("scene"), "name") + ": " : std::string();
      fast.paragraphs.push_back(scene + how_wrong_is_fast(m.json));
      choice.paragraphs.push_back(scene + what_to_choose(m.json));
      leave.paragraphs.push_back(scene + what_to_leave_out(m.json));
    });
  }
  for (const Measurement& m : input.stability)
    stable.paragraphs.push_back(complete(m, [&] { return is_mine_stable(m.json); }));
  const char* const accuracy = "Not measured: add the JSON report of bristle accuracy SCENE.";
  for (Answer* answer : {&fast, &choice, &leave})
    if (answer->paragraphs.empty()) answer->paragraphs.emplace_back(accuracy);
  if (stable.paragraphs.empty())
    stable.paragraphs.emplace_back("Not measured: add the JSON report of bristle stability.");
  return {fast, choice, stable, leave};
}

std::string report_page(const ReportInput& input, const std::string& written) {
  HtmlPage page;
  page.answers(report_answers(input));
  page.section("summary", "At a glance");
  add_summary(page, input);
  page.section("how-to-read", "How to read this");
  add_how_to_read(page);
  page.section("machine", "Machine and build");
  add_machine(page, input);
  const auto add_kind = [&](const std::vector<Measurement>& kind, const std::string& id, const char* title,
                            auto add) {
    int count = 0;
    for (const Measurement& m : kind) {
      if (count == 0) page.section(id, title);
      ++count;
      const std::string place = fmt::format("{}-{}", id, count);
      if (kind.size() > 1) page.paragraph("From " + fs::path(m.file).filename().string() + ":");
      complete(m, [&] { add(page, place, m); });
    }
  };
  add_kind(input.capacity, "capacity", "Capacity: how much fits in a step", add_capacity);
  add_kind(input.accuracy, "accuracy", "Error against run time", add_accuracy);
  add_kind(input.stability, "stability", "Stability in closed loop", add_stability);
  if (!input.pictures.empty()) {
    page.section("pictures", "Further curves");
    add_other_pictures(page, input.pictures);
  }
  const Json& c = all_of(input).front()->json.at("conditions");
  return page.text(
      "bristle: speed, error, stability",
      fmt::format("{}, commit {}; page written {}", text_of(c, "cpu"), text_of(c, "commit"), written));
}

void report_command(const ReportOptions& options) {
  std::vector<FileOption> inputs;
  for (const std::string& file : options.files) inputs.push_back({"FILE", file});
  check_files(inputs, {{"--out", options.out}});
  const ReportInput input = read_report_input(options.files);
  OutputFile(options.out).write(report_page(input, conditions().time));
  if (options.out == "-") return;
  std::string text;
  for (const Answer& answer : report_answers(input)) {
    text += answer.question;
    for (const std::string& paragraph : answer.paragraphs) text += ' ' + paragraph;
    text += '\n';
  }
  print_report(text + "\nThe page: " + options.out + '\n');
}

}  // namespace cli
