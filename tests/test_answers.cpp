// Texts that a user sees first: answers in words, lines of at most 80 columns, help and completion.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/libraries/reports/answers.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/reports/text_layout.hpp"

#include "command_line.hpp"
#include "temporary_folder.hpp"

namespace bristle_test::test_answers {

using Folder = TemporaryFolder;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using nlohmann::json;

namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Returns the first paragraph of a text, as one line.
std::string answer_of(const std::string& text) {
  std::string answer = text.substr(0, text.find("\n\n"));
  std::replace(answer.begin(), answer.end(), '\n', ' ');
  return answer;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// Returns the output of `bristle PATH --help`, cached.
const Outcome& help_of(const Folder& folder, const std::string& path) {
  static std::map<std::string, Outcome> all;
  const auto found = all.find(path);
  return found != all.end() ? found->second : all[path] = run_cli(folder, path + " --help");
}

/// Returns the subcommands and options that a command's --help lists.
std::vector<std::string> helped_words(const Folder& folder, const std::string& path) {
  std::vector<std::string> words;
  std::string section;
  for (const std::string& line : lines_of(help_of(folder, path).out)) {
    if (!line.empty() && line[0] != ' ') section = line;
    // Entries of a help text are indented by two spaces, their further lines by more.
    if (line.size() < 3 || line.substr(0, 2) != "  " || line[2] == ' ') continue;
    std::string first = words_of(line)[0];
    if (section != "Subcommands:" && section != "Options:") continue;
    for (std::size_t comma; (comma = first.find(',')) != std::string::npos; first.erase(0, comma + 1))
      words.push_back(first.substr(0, comma));
    words.push_back(first);
  }
  return words;
}

/// Returns the names of all commands: "", "run", ... "experiment drift", ...
std::vector<std::string> command_paths(const Folder& folder) {
  std::vector<std::string> paths = {""};
  for (std::size_t i = 0; i < paths.size(); ++i) {
    // Looks at one experiment only, because all experiments have equal options.
    std::size_t experiments = 0;
    for (const std::string& word : helped_words(folder, paths[i]))
      if (word[0] != '-' && (paths[i] != "experiment" || ++experiments <= 1))
        paths.push_back(paths[i].empty() ? word : paths[i] + ' ' + word);
  }
  return paths;
}

std::string output_of(const std::string& command) {
  std::string text;
  std::FILE* pipe = popen(command.c_str(), "r");
  REQUIRE(pipe != nullptr);
  char block[4096];
  while (const std::size_t got = std::fread(block, 1, sizeof block, pipe)) text.append(block, got);
  pclose(pipe);
  return text;
}

/// Sets the width of text lines while this object lives; its end restores the process's text layout.
struct Columns {
  explicit Columns(std::size_t columns) { cli::text_layout().columns = columns; }
  ~Columns() { cli::text_layout() = cli::TextLayout(); }
};

}  // namespace

TEST_CASE("A body without damping is said to ring, and the damping that is named brings it to rest",
          "[answers]") {
  const Folder folder;
  const std::string damped = read_file(BRISTLE_SCENES "/block_on_floor.toml");
  std::string bare = damped;
  bare.erase(bare.find("damping_per_newton"),
             bare.find('\n', bare.find("damping_per_newton")) - bare.find("damping_per_newton"));
  // Returns the largest change of the force per step within 100 ms before the block is pushed back.
  const auto run = [&](const std::string& text, std::string& answer) {
    const Outcome outcome =
        run_cli(folder, "run '" + folder.write("s.toml", text) + "' --csv '" + folder.at("f.csv") + "'");
    REQUIRE(outcome.code == 0);
    answer = answer_of(outcome.out);
    double most = 0.0, last = 0.0;
    for (const std::string& row : lines_of(read_file(folder.at("f.csv")))) {
      const double t = std::strtod(row.c_str(), nullptr);
      const double force = std::strtod(row.c_str() + row.find("base,") + 5, nullptr);
      if (t > 2.75 && t < 2.85) most = std::max(most, std::abs(force - last));
      last = force;
    }
    return most;
  };
  std::string answer;
  CHECK(run(damped, answer) < 1e-6);
  CHECK_THAT(answer, !Contains("rings"));
  CHECK(run(bare, answer) > 0.1);
  const std::string name =
      "block rings on its bristles when it sticks, because nothing damps it; "
      "damping_per_newton = ";
  REQUIRE_THAT(answer, Contains(name));
  const std::string value = words_of(answer.substr(answer.find(name) + name.size()))[0];
  // A quarter of critical damping by the formula of tools/scenes/README.md.
  CHECK(std::stod(value) == Approx(0.5 * std::sqrt(1.95 * 0.4 / (9.81 * 20e-6))).epsilon(0.02));
  bare.insert(bare.find("stribeck_velocity"), "damping_per_newton = " + value + "\n");
  CHECK(run(bare, answer) < 1e-6);
}

TEST_CASE("A table fits 80 columns: headers and texts are broken, columns without room are named below",
          "[answers]") {
  cli::Table table({"<name", "a header of many words", "<why", "one", "two", "three", "four", "five", "six"});
  const std::string why = "a reason that takes more than one line of the column that it is given here";
  table.add({"first", "12.5", why, "1000000", "2000000", "3000000", "4000000", "5000000", "6000000"});
  table.add_note("a note");
  const std::string text = table.text();
  check_width("table", text);
  for (const std::string& word : words_of(why + " 1000000 5000000 a header of many words"))
    CHECK_THAT(text, Contains(word));
  // Checks that the row's name and note appear once, and that no figure of a column without room does.
  std::size_t names = 0, notes = 0;
  for (const std::string& line : lines_of(text)) {
    names += line.rfind("first", 0) == 0 ? 1 : 0;
    notes += line == "a note" ? 1 : 0;
  }
  CHECK(names == 1);
  CHECK(notes == 1);
  CHECK_THAT(text, !Contains("6000000") &&
                       Catch::Matchers::EndsWith("\nColumns without room (--wide shows them): \"six\".\n"));
  {
    const Columns wide(0);
    CHECK(lines_of(table.text()).size() == 3);
    CHECK(cli::width_of(lines_of(table.text())[1]) == table.natural_width());
  }
  cli::Table small({"<a", "b"});
  small.add({"x", "1"});
  CHECK(small.text() == "a  b\nx  1\n");
  CHECK(small.markdown() == "|a|b|\n|---|---|\n|x|1|\n");
}

TEST_CASE("Numbers keep three digits and no needless powers of ten", "[answers]") {
  const std::pair<double, const char*> table[] = {
      {0.0, "0"},     {0.4321, "0.432"},       {9.999, "10"},        {1234567.0, "1234567"},
      {100.0, "100"}, {-0.0123456, "-0.0123"}, {2.5e-19, "2.5e-19"}, {30.0, "30"},
      {1e9, "1e+09"}};
  for (const auto& [value, text] : table) CHECK(cli::number_text(value) == text);
  CHECK(cli::number_text(nullptr) == "-");
}

TEST_CASE("A table says the same as text and CSV", "[answers]") {
  struct Row {
    const char *group, *name;
    double value;
  };
  const std::vector<cli::Column<Row>> columns = {
      {"<group", [](const Row& r) { return cli::Cell(r.group); }},
      {"<name", [](const Row& r) { return cli::Cell(r.name); }},
      {"value", [](const Row& r) { return cli::Cell(cli::number_text(r.value), cli::CellStyle::bad); }}};
  const std::vector<Row> rows = {{"a", "x, y", 1.5}, {"a", "\xC2\xB5<", 12.0}, {"b", "say \"z\"", 0.0}};
  cli::Table table = cli::tabulate(rows, columns, 1);
  table.add_note("a note");
  CHECK(table.text() ==
        "group  name     value\na      x, y       1.5\n       \xC2\xB5<          12\nb      say \"z\"      "
        "0\na note\n");
  CHECK(table.csv() == "group,name,value\na,\"x, y\",1.5\n,\xC2\xB5<,12\nb,\"say \"\"z\"\"\",0\n");
}

TEST_CASE("CSV of a report's rows finds values by pointer, scales numbers, and leaves null empty",
          "[answers]") {
  const cli::Json rows = cli::Json::parse(
      R"([{"a": {"b": 2e-6}, "yes": true, "n": null, "i": 7, "s": "x, y"}, {"yes": false}])");
  const cli::CsvColumn columns[] = {{"b_us", "/a/b", 1e6}, {"yes", "/yes"}, {"n", "/n"},
                                    {"none", "/a/c"},      {"i", "/i"},     {"s", "/s"}};
  CHECK(cli::csv_text(rows, columns) == "b_us,yes,n,none,i,s\n2,1,,,7,\"x, y\"\n,0,,,,\n");
}

TEST_CASE("bash completes every command and option that --help lists", "[answers]") {
  const Folder folder;
  const std::string script = folder.write("completion", run_cli(folder, "completion").out);
  const std::vector<std::string> paths = command_paths(folder);
  // Runs one shell that completes command lines at all places: for each it prints the words that may follow,
  // then those that begin with "--".
  std::string program = "source '" + script +
                        "'\ncompopt() { printf 'compopt %s ' \"$*\"; }\ntry() { COMP_WORDS=(\"$@\"); "
                        "COMP_CWORD=$(($# - 1)); COMPREPLY=(); _bristle; echo \"${COMPREPLY[*]}\"; }\ncd '" +
                        folder.at("") + "'\n";
  const auto complete = [&](const std::string& words) { program += "try bristle " + words + '\n'; };
  for (const std::string& path : paths) {
    complete(path + " ''");
    complete(path + " -");
  }
  const std::pair<const char*, const char*> cases[] = {
      {"fit d.csv --law l", "lognormal"},
      {"run --out compl", "compopt -o default "},  // a file, which bash itself completes
      {"run sc", "compopt -o default "},
      {"run --rate ''", ""},  // a number
      {"experiment drift --models coulomb,lu", "coulomb,lugre"},
      {"run --isa sca", "scalar"},
      {"run '$(touch executed)' '`touch executed`' 'a[$(touch executed)]' --isa sca", "scalar"},
  };
  for (const auto& [words, reply] : cases) complete(words);
  const std::vector<std::string> replies =
      lines_of(output_of("bash '" + folder.write("try.sh", program) + "' 2>&1"));
  REQUIRE(replies.size() == 2 * paths.size() + std::size(cases));
  for (std::size_t i = 0; i < paths.size(); ++i) {
    CAPTURE(paths[i]);
    std::vector<std::string> all = words_of(replies[2 * i]);
    const std::vector<std::string> options = words_of(replies[2 * i + 1]);
    all.insert(all.end(), options.begin(), options.end());
    const std::set<std::string> offered(all.begin(), all.end());
    for (const std::string& word : helped_words(folder, paths[i])) {
      CAPTURE(word);
      CHECK(offered.count(word) == 1);
    }
    CHECK(options.size() >= 2);  // --help and -h
  }
  for (std::size_t i = 0; i < std::size(cases); ++i) {
    CAPTURE(cases[i].first);
    CHECK(replies[2 * paths.size() + i] == cases[i].second);
  }
  CHECK_FALSE(std::filesystem::exists(folder.at("executed")));
}

}  // namespace bristle_test::test_answers
