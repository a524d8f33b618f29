// The page of `bristle report`: well-formed, of one piece, and with the numbers of the reports it is made
// from.
#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "made_up_reports.hpp"
#include "temporary_folder.hpp"
#include "tools/files/user_error.hpp"
#include "tools/reports/html_page.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/report.hpp"
#include "tools/reports/table.hpp"

using Catch::Matchers::Contains;

namespace {

using Folder = bristle_test::TemporaryFolder;
using namespace bristle_test;

std::string page_of(const std::vector<std::string>& files) {
  return cli::report_page(cli::read_report_input(files), "2026-02-01T00:00:00Z");
}

void check_refused(const std::vector<std::string>& files, const std::string& part) {
  CHECK_THROWS_AS(page_of(files), cli::UserError);
  try {
    page_of(files);
  } catch (const cli::UserError& error) {
    CHECK_THAT(error.what(), Contains(part));
  }
}

/// Text of an exception that is no UserError naming the file; empty if the refusal is right.
std::string wrong_refusal(const Folder& folder, const Json& report) {
  try {
    return fault_of(page_of({folder.write("other.json", report.dump())}));
  } catch (const cli::UserError& error) {
    const std::string text = error.what();
    return text.find("other.json: ") == std::string::npos ? text : "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

const std::string png_bytes("\x89PNG\r\n\x1A\n\0\xFF rest", 14);

}  // namespace

TEST_CASE("Pictures become base64 as RFC 4648 has it", "[report]") {
  // Section 10 of the RFC.
  const char* const table[][2] = {{"", ""},
                                  {"f", "Zg=="},
                                  {"fo", "Zm8="},
                                  {"foo", "Zm9v"},
                                  {"foob", "Zm9vYg=="},
                                  {"fooba", "Zm9vYmE="},
                                  {"foobar", "Zm9vYmFy"}};
  for (const auto& row : table) CHECK(cli::base64(row[0]) == row[1]);
  CHECK(cli::base64("\xFF\xEF\xBE") == "/+++");
}

TEST_CASE("The report page is well-formed, of one piece, and shows the numbers of its reports", "[report]") {
  const Folder folder;
  const std::string page =
      page_of({folder.write("capacity.json", capacity_report()),
               folder.write("accuracy_a.json", accuracy_report("fingertip")),
               folder.write("accuracy_b.json", accuracy_report("other")),
               folder.write("stability.json", stability_report()), folder.write("capacity.png", png_bytes),
               folder.write("long_motion.png", png_bytes)});
  CHECK(fault_of(page) == "");
  for (const char* part :
       {// the first screen
        "<h2>How wrong is a fast setting?</h2>", "The fastest tried is 0.831 % wrong at 5.31 us a step",
        "<h2>What to choose?</h2>", "0.918 % wrong when run again", "<h2>Is mine stable?</h2>",
        "<h2>What to leave out?</h2>",
        // what a point of a chart says
        "0.831 %, 5.31 us: 13,000 bristles a patch, steps of 1.00",
        // machine and build
        "Test &amp; CPU &lt;7&gt;", "abc1234", "GNU 12 -O3", "avx2", "00c0ffee00c0ffee",
        "2026-01-31T12:00:00Z", "page written 2026-02-01",
        // capacity
        "1,543,000", ">1,714<", ">0.642<", ">987 us<", ">2.50 ms<", ">0.432<", "MISSED", ">0.77<",
        "0.761 to 0.783", "the other loop", "1 of 2 speed targets met; missed: second",
        "Not measured in this run.",
        // accuracy: one digit less where it is a zero
        "13,000", ">0.831<", ">0.918<", ">4.36<", ">5.44<", "0.544 % of the deadline", "13 of 10,000",
        ">-0.47<", ">39<", "38 to 40", ">2.13<", ">2.69<", "2 more were too slow",
        "bristles = 13000  # &lt;pasted&gt; &amp; used",
        // stability
        ">75.0 %<", "1 not: other", ">0.999<", "runs away", ">-2.5e-19<", ">1.3<", ">87.5 %<", ">80.0 %<",
        ">0.8<", ">0.2<", ">1.7<", "b = 0.501 K T", ">creep<", ">52.5<", ">23<", ">12600<", ">1.024<",
        ">3.21 to 4.56<", ">-0.012 to 6.78<", "below the stiffness of linear theory, to within 2.38 %",
        "creeps by at most 2.5e-19 m in 3600"}) {
    CAPTURE(part);
    CHECK(page.find(part) != std::string::npos);
  }
  // Answers before everything else.
  CHECK(page.find("class=\"answers\"") < page.find("<nav>"));
  CHECK(page.find("What to leave out?") < page.find("At a glance"));
  // The pictures, byte for byte.
  const std::string image = "src=\"data:image/png;base64," + cli::base64(png_bytes) + "\"";
  const std::size_t first = page.find(image);
  REQUIRE(first != std::string::npos);
  CHECK(page.find(image, first + 1) != std::string::npos);
  // capacity.png stands in the part of capacity.json, long_motion.png, which has no report, at the end.
  CHECK(first < page.find("<h2 id=\"accuracy\""));
  CHECK(page.rfind(image) > page.find("<h2 id=\"pictures\""));
}

TEST_CASE("A row that no run confirmed is not said to be too slow", "[report]") {
  const Folder folder;
  std::string report = capacity_report();
  const std::string bristles = "\"bristles\": 1543000";
  report.replace(report.find(bristles), bristles.size(), "\"bristles\": 0, \"unconfirmed\": true");
  const std::string page = page_of({folder.write("capacity.json", report)});
  CHECK(page.find(">not confirmed: machine too busy<") != std::string::npos);
  CHECK(page.find("Bristles that all snap, threads: 1: not confirmed") != std::string::npos);
  CHECK(page.find("fewer than 900") == std::string::npos);
}

TEST_CASE("Names in a report cannot break the page", "[report]") {
  const Folder folder;
  const std::string page =
      page_of({folder.write("a<b>&\"c'.json", accuracy_report("</title><script src=\"//x\">'&amp;\x01")),
               folder.write("z.json", accuracy_report("\xC3\xA4 name"))});
  CHECK(fault_of(page) == "");
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("&lt;/title&gt;&lt;script src=&quot;//x&quot;&gt;&#39;&amp;amp;\xEF\xBF\xBD") !=
        std::string::npos);
  CHECK(page.find("\xC3\xA4 name") != std::string::npos);
}

TEST_CASE("Reports of different builds stand side by side with a warning", "[report]") {
  const Folder folder;
  std::string other = stability_report();
  other.replace(other.find("abc1234"), 7, "def5678");
  const std::string capacity = folder.write("capacity.json", capacity_report());
  CHECK(page_of({capacity}).find("different machines or builds") == std::string::npos);
  const std::string page = page_of({capacity, folder.write("stability.json", other)});
  CHECK(fault_of(page) == "");
  CHECK(page.find("different machines or builds") != std::string::npos);
  CHECK(page.find(">abc1234</td>") != std::string::npos);
  CHECK(page.find(">def5678</td>") != std::string::npos);
}

TEST_CASE("What is no report or no picture is refused by name", "[report]") {
  const Folder folder;
  check_refused({(folder.path / "none.json").string()}, "none.json: cannot be read");
  check_refused({folder.write("text.json", "{")}, "text.json: not JSON");
  check_refused({folder.write("run.json", R"({"schema": "bristle-run-1"})")},
                "schema is 'bristle-run-1'; allowed:");
  check_refused({folder.write("array.json", "[1]")}, "schema is ''");
  check_refused({folder.write("false.png", "GIF89a")}, "not a PNG picture");
  check_refused({folder.write("alone.png", png_bytes)}, "no JSON report among the files");
  std::string cut = capacity_report();
  cut.replace(cut.find("\"at_capacity\""), 13, "\"at\"");
  check_refused({folder.write("cut.json", cut)}, "cut.json: not a complete bristle-capacity-1 report");
  std::string none = capacity_report();
  none.replace(none.find("{\"bristles\": 900}"), 17, "{\"bristles\": 0}");
  check_refused({folder.write("none_of.json", none)}, "none_of.json: paper.bristles is 0");
  check_refused({folder.write("bare.json", R"({"schema": "bristle-stability-1"})")},
                "bare.json: not a complete");
}

TEST_CASE("A report whose fields have other types is refused by file, place and what belongs there",
          "[report]") {
  const Folder folder;
  const struct {
    std::string report;
    const char *place, *value, *message;
  } cases[] = {
      {capacity_report(), "/conditions/cpu", "7", "conditions.cpu is 7; it must be a text"},
      {capacity_report(), "/conditions/cpu", "null", "conditions.cpu is null; it must be a text"},
      {capacity_report(), "/conditions/cores", "-2", "conditions.cores is -2; it must be a whole number"},
      {capacity_report(), "/conditions", "[]", "conditions is []; it must be an object"},
      {capacity_report(), "/quick", "0", "quick is 0; it must be true or false"},
      {capacity_report(), "/targets/1/met", "\"yes\"", "targets[1].met is \"yes\"; it must be true or false"},
      {capacity_report(), "/targets/0/spread", "[1]", "targets[0].spread is [1]; it must be a list of two"},
      {capacity_report(), "/capacities/0/bristles", "1e40",
       "capacities[0].bristles is 1e+40; it must be a whole"},
      {capacity_report(), "/capacities/0", "3", "capacities is [3]; it must be a list of objects"},
      {accuracy_report("s"), "/settings/0/error/rms", "{}", "settings[0].error.rms is an object; it must be"},
      {accuracy_report("s"), "/settings/0/bristles", "null", "not a complete bristle-accuracy-1 report"},
      {stability_report(), "/k", "[]", "k is []; it must be a list of numbers, one at least"},
      {stability_report(), "/maps/0/why_not/other", "1.5",
       "maps[0].why_not is an object; it must be an object of"},
  };
  for (const auto& c : cases) {
    CAPTURE(c.place, c.value);
    Json report = Json::parse(c.report);
    report[Place(c.place)] = Json::parse(c.value);
    check_refused({folder.write("typed.json", report.dump())},
                  std::string("typed.json: ") + "not a complete");
    check_refused({folder.write("typed.json", report.dump())}, c.message);
  }
}

TEST_CASE("Whatever stands in place of a report's value, it is refused in one line or makes a page",
          "[report]") {
  const Folder folder;
  const Json others[] = {nullptr,
                         true,
                         7,
                         -1,
                         1.5,
                         1e300,
                         "text",
                         Json::array(),
                         Json::object(),
                         Json::array({1}),
                         Json::array({Json::object()})};
  for (const std::string& text : {capacity_report(), accuracy_report("scene"), stability_report()}) {
    const Json report = Json::parse(text);
    REQUIRE(wrong_refusal(folder, report) == "");
    std::vector<Place> places;
    collect_places(report, Place(), places);
    REQUIRE(places.size() > 40);
    std::vector<std::string> wrong;
    for (const Place& place : places) {
      for (const Json& other : others) {
        Json changed = report;
        changed[place] = other;
        const std::string said = wrong_refusal(folder, changed);
        if (!said.empty()) wrong.push_back(place.to_string() + " = " + other.dump() + ": " + said);
      }
      Json changed = report;
      Json& parent = changed[place.parent_pointer()];
      if (!parent.is_object()) continue;
      parent.erase(place.back());
      const std::string said = wrong_refusal(folder, changed);
      if (!said.empty()) wrong.push_back(place.to_string() + " missing: " + said);
    }
    CHECK_THAT(wrong, Catch::Matchers::Equals(std::vector<std::string>{}));
  }
}

TEST_CASE("Numbers of the page keep three digits and no needless powers of ten", "[report]") {
  const std::pair<double, const char*> table[] = {
      {0.0, "0"},     {0.4321, "0.432"},       {9.999, "10"},        {1234567.0, "1234567"},
      {100.0, "100"}, {-0.0123456, "-0.0123"}, {2.5e-19, "2.5e-19"}, {30.0, "30"},
      {1e9, "1e+09"}};
  for (const auto& [value, text] : table) CHECK(cli::number_text(value) == text);
  CHECK(cli::number_text(nullptr) == "-");
}

TEST_CASE("A table says the same as text, CSV and HTML", "[report]") {
  struct Row {
    const char *group, *name;
    double value;
  };
  const std::vector<cli::Column<Row>> columns = {
      {"<group", [](const Row& r) { return cli::Cell(r.group); }},
      {"<name", [](const Row& r) { return cli::Cell(r.name); }},
      {"value", [](const Row& r) { return cli::Cell(cli::number_text(r.value), cli::CellStyle::bad); }},
      {"seen", [](const Row&) { return cli::Cell("there"); }, cli::Column<Row>::page_only}};
  const std::vector<Row> rows = {{"a", "x, y", 1.5}, {"a", "\xC2\xB5<", 12.0}, {"b", "say \"z\"", 0.0}};
  cli::Table table = cli::tabulate(rows, columns, cli::Medium::terminal, 1);
  table.add_note("a note");
  CHECK(table.text() ==
        "group  name     value\na      x, y       1.5\n       \xC2\xB5<          12\nb      say \"z\"      "
        "0\na note\n");
  CHECK(table.csv() == "group,name,value\na,\"x, y\",1.5\n,\xC2\xB5<,12\nb,\"say \"\"z\"\"\",0\n");
  const std::string page = cli::tabulate(rows, columns, cli::Medium::page).html();
  for (const char* part : {"<th class=\"left\">group</th>", "<td class=\"left\">\xC2\xB5&lt;</td>",
                           "<td class=\"bad\">12</td>", "<td>there</td>"}) {
    CAPTURE(part);
    CHECK_THAT(page, Contains(part));
  }
}
