// `bristle sweep`: ranges given by hand and by tables, rows compared with `bristle run`, and one
// result whoever computes it and however often it is interrupted.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include <bristle/patch_batch.hpp>

#include "command_line.hpp"
#include "expect.hpp"
#include "temporary_folder.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/sweep/override.hpp"
#include "tools/libraries/sweep/sweep.hpp"

namespace bristle_test::test_sweep {

using Catch::Matchers::Contains;
using cli::UserError;
using Folder = TemporaryFolder;

namespace {

const std::string slide_scene = R"(
[scene]
name = "slide"
dt = 1e-3
duration = 0.3

[[material]]
name = "wood"
kinetic = 0.4
peak = 0.46
presliding_length = 1e-5

[[patch]]
name = "tip"
material = "wood"
max_normal_load = 1.0
bristles = 200
axes = 1
outputs = ["mean", "energy"]

[[motion]]
patch = "tip"
type = "ramp"
velocity = 1e-3
load = 0.8
)";

/// Runs `bristle sweep`, requires that it succeeds, and returns its table.
std::string table_of(const Folder& folder, const std::string& arguments,
                     const std::string& environment = "") {
  const Outcome outcome =
      run_cli(folder, "sweep " + arguments + " --out '" + folder.at("table.csv") + "'", environment);
  INFO(arguments << '\n' << outcome.err);
  REQUIRE(outcome.code == 0);
  return read_file(folder.at("table.csv"));
}

std::string cell(const std::vector<std::vector<std::string>>& table, std::size_t row,
                 const std::string& head) {
  const auto found = std::find(table[0].begin(), table[0].end(), head);
  INFO(head);
  REQUIRE(found != table[0].end());
  return table[row + 1][static_cast<std::size_t>(found - table[0].begin())];
}
double number(const std::vector<std::vector<std::string>>& table, std::size_t row, const std::string& head) {
  return std::stod(cell(table, row, head));
}

std::vector<double> numbers_of(const std::string& range) {
  std::vector<double> numbers;
  for (const cli::SweepValue& value : cli::parse_varied("key=" + range).values)
    numbers.push_back(value.get<double>());
  return numbers;
}

/// Arguments of a sweep with twelve rows, each of which takes milliseconds to compute.
const std::string twelve_rows =
    "--vary material.wood.kinetic=0.3:0.45:3 --vary motion.tip.velocity=5e-4,1e-3 --repeat 2";

cli::StudyOptions study_options(const std::string& scene) {
  cli::StudyOptions options;
  options.scene = scene;
  options.vary = {"material.wood.kinetic=0.3:0.45:3", "motion.tip.velocity=5e-4,1e-3"};
  options.repeat = 2;
  return options;
}

}  // namespace

// ---------------------------------------------------------------------------------------------- ranges

TEST_CASE("Ranges of a sweep are linear, logarithmic, whole, or lists of any TOML value", "[sweep]") {
  CHECK(numbers_of("0.1:0.5:5") == std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5});
  CHECK(numbers_of("1e-6:1e-3:4:log") == std::vector<double>{1e-6, 1e-5, 1e-4, 1e-3});
  CHECK(numbers_of("100:100000:4:log:int") == std::vector<double>{100, 1000, 10000, 100000});
  CHECK(numbers_of("5:1:3") == std::vector<double>{5, 3, 1});
  CHECK(numbers_of("-2:7:1") == std::vector<double>{-2});
  CHECK(cli::parse_varied("k=1:9:3").values[1].is_number_integer());
  CHECK(cli::parse_varied("k=1:8:3").values[1] == 4.5);
  CHECK(cli::parse_varied("k=1:8:3:int").values[1] == 5);
  const auto list =
      cli::parse_varied("k=[1e-3, 0.0], keep , 3, 0.5,{ law = \"single\", length = 1e-5 }").values;
  REQUIRE(list.size() == 5);
  CHECK(list[0] == "[1e-3, 0.0]");
  CHECK(list[1] == "keep");
  CHECK(list[2] == 3);
  CHECK(list[3] == 0.5);
  CHECK(list[4] == "{ law = \"single\", length = 1e-5 }");
  for (const char* bad :
       {"k", "=1", "k=", "k=1:2:x", "k=1:2:0", "k=0:2:3:log", "k=1,,2", "k=1:2:3:4", "k=1:2"}) {
    INFO(bad);
    CHECK_THAT(message_of<UserError>([&] { cli::parse_varied(bad); }), Contains(bad));
  }
}

// ------------------------------------------------------------------------------------------------ keys

TEST_CASE("A dotted path sets any key of a scene", "[sweep]") {
  toml::table root = cli::parse_toml(
      "[scene]\ndt = 1e-3\n[[material]]\nname = 'a'\nsnap_length = { law = 'single', length = 1e-5 }\n"
      "[[material]]\nname = 'b'\n[[patch]]\nname = 'p'\n[[motion]]\npatch = 'p'\nvelocity = [1.0, 2.0]\n"
      "[[body]]\nname = 'c'\nforce = [ { t = 0.0, x = 1.0 }, { t = 1.0, x = 2.0 } ]\n",
      "scene");
  cli::set_key(root, "scene.dt", 2e-3);
  CHECK(root["scene"]["dt"].value<double>() == 2e-3);
  cli::set_key(root, "material.a.snap_length.length", 2e-5);
  CHECK(root["material"][0]["snap_length"]["length"].value<double>() == 2e-5);
  cli::set_key(root, "material.*.kinetic", 0.3);
  CHECK(root["material"][0]["kinetic"].value<double>() == 0.3);
  CHECK(root["material"][1]["kinetic"].value<double>() == 0.3);
  cli::set_key(root, "motion.p.velocity.1", 5);
  CHECK(root["motion"][0]["velocity"][1].value<std::int64_t>() == 5);
  cli::set_key(root, "motion.velocity", "[3.0, 4.0]");
  CHECK(root["motion"][0]["velocity"][0].value<double>() == 3.0);
  cli::set_key(root, "body.c.force.1.x", 7.5);
  CHECK(root["body"][0]["force"][1]["x"].value<double>() == 7.5);
  cli::set_key(root, "patch.bristles", 100);
  CHECK(root["patch"][0]["bristles"].value<std::int64_t>() == 100);
  cli::set_key(root, "material.b.rule", "keep");
  CHECK(root["material"][1]["rule"].value<std::string>() == "keep");

  const auto complaint = [&](const std::string& path) {
    return message_of<UserError>([&] { cli::set_key(root, path, 1.0); });
  };
  CHECK_THAT(complaint("materiel.a.kinetic"), Contains("did you mean 'material'"));
  CHECK_THAT(complaint("body.d.mass"), Contains("no body 'd'") && Contains("there are: c"));
  CHECK_THAT(complaint("body.c.force.2.x"), Contains("allowed: 0 to 1"));
  CHECK_THAT(complaint("material.kinetic"), Contains("no material 'kinetic'"));
  CHECK_THAT(complaint("material.a.snap_lenght.length"), Contains("did you mean 'snap_length'"));
  CHECK_THAT(complaint("material.a"), Contains("material.a.KEY"));
  CHECK_THAT(complaint("scene"), Contains("scene.KEY"));
  cli::set_key(root, "material.a.peak", 0.5);
  // A key set as peak_over_kinetic replaces `peak`, because a scene takes only one of the two.
  cli::set_key(root, "material.a.peak_over_kinetic", 1.2);
  CHECK_FALSE(root["material"][0].as_table()->contains("peak"));
  cli::set_key(root, "material.a.peak", 0.5);
  CHECK_FALSE(root["material"][0].as_table()->contains("peak_over_kinetic"));
}

TEST_CASE("An unknown key, name or result is refused at once with the nearest one", "[sweep]") {
  const Folder folder;
  const std::string scene = "sweep '" + folder.write("slide.toml", slide_scene) + "' ";
  const auto refused = [&](const std::string& arguments, const std::string& why) {
    const Outcome outcome = run_cli(folder, scene + arguments);
    INFO(arguments);
    CHECK(outcome.code == 2);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    CHECK_THAT(outcome.err, Contains(why));
  };
  refused("--vary material.wood.kinetik=0.1,0.2", "did you mean 'kinetic'");
  refused("--vary material.wod.kinetic=0.1,0.2", "did you mean 'wood'");
  refused("--vary patch.tip.bristels=10,20", "did you mean 'bristles'");
  refused("--vary patch.tip.bristles=10,20 --report kinetc", "did you mean 'kinetic'");
  refused("--vary patch.tip.bristles=10:20", "NUMBER");
  refused("--vary k=0.3..0.4", "'..' makes no range; allowed: KEY=FROM:TO:NUMBER");
  refused("--vary patch.tip.bristles=10,20 --vary patch.tip.bristles=30", "twice");
  refused("--vary patch.tip.bristles=10,20 --seed -1", "--seed");
  refused("--vary patch.tip.bristles=10,20 --seed 4294967296", "--seed");
  refused("--vary patch.tip.seed=10,20 --repeat 2", "take one of the two");
  refused("--vary patch.tip.bristles=10,20 --isa fast", "fast");
  refused("--vary patch.tip.bristles=1.5,2.5", "every row was refused");
  refused("--vary patch.tip.bristles=10,20 --out '" + folder.at("table.nc") + "'", "tables are CSV");
  refused("--vary patch.tip.bristles=10,20 --out '" + folder.at(std::string(300, 'n')) + "'",
          "cannot be written");
  for (const std::string option : {"--set", "--vary", "--reference"})
    refused("--vary patch.tip.seed=1,2 " + option + " scene.dt=1e-3 patch.tip.bristles=10",
            "'patch.tip.bristles=10' has no option before it; write " + option + " scene.dt=1e-3 " + option +
                " patch.tip.bristles=10");
}

TEST_CASE("A sweep that every row refuses says once why, and which key to leave out", "[sweep]") {
  const Folder folder;
  std::string both = slide_scene;
  both.replace(both.find("peak = 0.46"), 11, "peak = 0.4668168944\nspread = 0.3");
  const std::string scene = folder.write("both.toml", both);
  const auto swept = [&](const std::string& values) {
    return run_cli(folder, "sweep '" + scene + "' --vary material.wood.kinetic=" + values +
                               " --report peak_in_theory --steps 5");
  };
  const Outcome none = swept("0.3,0.5");
  CHECK(none.code == 2);
  CHECK(none.out.empty());
  CHECK_THAT(none.err, Contains("every row was refused; row 0") && Contains("leave out peak (0)"));
  const Outcome some = swept("0.3,0.4");
  CHECK(some.code == 0);
  CHECK_THAT(some.out, Contains("1 of 2 rows were refused (column failure); row 0"));
  // Follows the advice: the peak then is in proportion to the kinetic friction.
  both.replace(both.find("peak = 0.4668168944"), 19, "");
  folder.write("both.toml", both);
  const auto table = csv_rows(table_of(
      folder, "'" + scene + "' --vary material.wood.kinetic=0.3,0.5 --report peak_in_theory --steps 5"));
  for (const std::size_t row : {0u, 1u})
    CHECK(number(table, row, "tip.peak_in_theory") ==
          Approx(0.4668168944 / 0.4 * (row == 0 ? 0.3 : 0.5)).epsilon(1e-6));
}

// ------------------------------------------------------------------------------------------------ rows

TEST_CASE("A row reports what bristle run reports of the same scene", "[sweep]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene);
  const auto table = csv_rows(table_of(
      folder, "'" + scene + "' --vary material.wood.kinetic=0.3,0.4 --report default,kinetic_in_theory"));
  REQUIRE(table.size() == 3);
  std::string by_hand = slide_scene;
  by_hand.replace(by_hand.find("kinetic = 0.4"), 13, "kinetic = 0.3");
  const std::string texts[] = {by_hand, slide_scene};
  for (std::size_t row = 0; row < 2; ++row) {
    const Outcome outcome =
        run_cli(folder, "run '" + folder.write("by_hand.toml", texts[row]) + "' --json -");
    REQUIRE(outcome.code == 0);
    const auto report = nlohmann::json::parse(outcome.out);
    const auto& patch = report["patches"][0];
    CHECK(cell(table, row, "state_hash") == report["state_hash"].get<std::string>());
    CHECK(number(table, row, "tip.fx_mean[N]") == patch["force"]["x"]["mean"].get<double>());
    CHECK(number(table, row, "tip.peak") == patch["coefficient"]["highest"].get<double>());
    CHECK(number(table, row, "tip.dissipated[J]") == patch["energy"]["dissipated"].get<double>());
    CHECK(number(table, row, "tip.snaps") == patch["energy"]["snaps"].get<double>());
    CHECK(number(table, row, "tip.kinetic_in_theory") == Approx(row == 0 ? 0.3 : 0.4));
    CHECK(number(table, row, "tip.x[m]") == Approx(0.3e-3));  // slide of 0.3 s at 1 mm/s
    CHECK(number(table, row, "tip.load_mean[N]") == Approx(0.8));
  }
}

TEST_CASE("A scene with the values and the seed of a row repeats the row", "[sweep]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene);
  const auto table = csv_rows(table_of(folder, "'" + scene + "' " + twelve_rows + " --report state_hash"));
  std::set<std::string> hashes;
  for (std::size_t row = 0; row < 12; ++row) hashes.insert(cell(table, row, "state_hash"));
  CHECK(hashes.size() == 12);  // states differ, as each repeat has a seed of its own
  std::string same = slide_scene;
  const auto put = [&](const std::string& what, const std::string& by) {
    same.replace(same.find(what), what.size(), by);
  };
  put("kinetic = 0.4", "kinetic = " + cell(table, 7, "material.wood.kinetic"));
  put("velocity = 1e-3", "velocity = " + cell(table, 7, "motion.tip.velocity[m/s]"));
  put("bristles = 200", "bristles = 200\nseed = " + cell(table, 7, "seed"));
  const Outcome run = run_cli(folder, "run '" + folder.write("row.toml", same) + "' --json -");
  REQUIRE(run.code == 0);
  CHECK(nlohmann::json::parse(run.out)["state_hash"].get<std::string>() == cell(table, 7, "state_hash"));
}

TEST_CASE("Values that a scene refuses make a row that says so, and the others run", "[sweep]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene);
  // Varies the peak beyond the limit of a lognormal law, 2.006 times the kinetic coefficient.
  const auto table =
      csv_rows(table_of(folder, "'" + scene + "' --vary material.wood.peak=0.46,0.9,-1 --report kinetic"));
  REQUIRE(table.size() == 4);
  CHECK(cell(table, 0, "failure").empty());
  CHECK(number(table, 0, "tip.kinetic") == Approx(0.4).epsilon(0.1));
  for (const std::size_t row : {1u, 2u}) {
    CHECK(cell(table, row, "tip.kinetic").empty());
    CHECK_THAT(cell(table, row, "failure"), Contains("peak") && Contains("allowed"));
    CHECK(cell(table, row, "failure").find(folder.path.string()) ==
          std::string::npos);  // the text has no path: it is identical everywhere
  }
}

TEST_CASE("A sweep's error is the rms difference to a reference run, and its window cuts the time",
          "[sweep]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene);
  const auto forces = [&](const std::string& text) {
    const std::string file = folder.at("forces.csv");
    const Outcome outcome =
        run_cli(folder, "run '" + folder.write("one.toml", text) + "' --out '" + file + "'");
    REQUIRE(outcome.code == 0);
    return csv_rows(read_file(file));
  };
  std::string many = slide_scene;
  many.replace(many.find("bristles = 200"), 14, "bristles = 5000");
  const auto ours = forces(slide_scene), truth = forces(many);
  double error = 0.0, square = 0.0, highest = 0.0, sum = 0.0;
  int steps = 0;
  for (std::size_t step = 0; step + 1 < ours.size(); ++step) {
    const double t = number(ours, step, "t");
    if (!(t > 0.1 + 1e-9 && t < 0.2 + 1e-9)) continue;
    const double a = number(ours, step, "fx"), b = number(truth, step, "fx");
    error += (a - b) * (a - b);
    square += b * b;
    highest = std::max(highest, std::abs(a) / 0.8);
    sum += std::abs(a) / 0.8;
    ++steps;
  }
  REQUIRE(steps == 100);
  const auto table = csv_rows(table_of(
      folder,
      "'" + scene + "' --vary material.wood.peak=0.46 --reference patch.tip.bristles=5000 --window 0.1:0.2"));
  CHECK(number(table, 0, "tip.error") == Approx(std::sqrt(error / square)).epsilon(1e-6));
  CHECK(number(table, 0, "tip.window_peak") == Approx(highest).epsilon(1e-6));
  CHECK(number(table, 0, "tip.window_mean") == Approx(sum / steps).epsilon(1e-6));
  const auto itself = csv_rows(
      table_of(folder, "'" + scene + "' --vary material.wood.peak=0.46 --reference patch.tip.bristles=200"));
  CHECK(number(itself, 0, "tip.error") == 0.0);
}

TEST_CASE("A trace belongs to a study: another content makes another study", "[sweep]") {
  const Folder folder;
  std::string scene = slide_scene.substr(0, slide_scene.find("type = "));
  scene.erase(scene.find("duration = 0.3\n"), 15);
  scene += "type = \"trace\"\nfile = \"motion.csv\"\n";
  folder.write("motion.csv", "t,x,load\n0,0,1\n0.1,1e-4,1\n");
  cli::StudyOptions options;
  options.scene = folder.write("trace.toml", scene);
  options.vary = {"material.wood.kinetic=0.3,0.4"};
  const cli::Study first(options);
  // Repeats a study in another folder, from the first one's recipe alone.
  const Folder elsewhere;
  const cli::Study copy(first.recipe(), elsewhere.path.string());
  CHECK(copy.hash() == first.hash());
  const std::string row = first.run_row(1);
  CHECK(copy.run_row(1) == row);
  folder.write("motion.csv", "t,x,load\n0,0,1\n0.1,2.5e-4,1\n");
  CHECK_THAT(message_of<UserError>([&] { first.run_row(1); }),
             Contains("motion.csv: changed while the sweep ran"));
  CHECK(copy.run_row(1) == row);
  const cli::Study second(options);
  CHECK(second.hash() != first.hash());
  CHECK(second.run_row(1) != row);
}

// ---------------------------------------------- one table, whichever threads or machines run the rows

TEST_CASE("A sweep's table is the same with any number of threads, on any instruction set",
          "[sweep][determinism]") {
  const Folder folder;
  const std::string scene = "'" + folder.write("slide.toml", slide_scene) + "' ";
  const std::string table = table_of(folder, scene + twelve_rows + " --threads 1");
  CHECK(csv_rows(table).size() == 13);
  CHECK(table_of(folder, scene + twelve_rows + " --threads 2") == table);
  CHECK(table_of(folder, scene + twelve_rows + " --threads 7") == table);
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    INFO(isa.name);
    CHECK(table_of(folder, scene + twelve_rows, std::string("BRISTLE_ISA=") + isa.name) == table);
  }
}

TEST_CASE("The peaks that a sweep asks for come out, or it says in how many rows they do not", "[sweep]") {
  const Folder folder;
  const auto summary = [&](const std::string& arguments) {
    const Outcome outcome = run_cli(folder, "sweep '" BRISTLE_SCENES "/" + arguments);
    REQUIRE(outcome.code == 0);
    std::string text = outcome.out;
    std::replace(text.begin(), text.end(), '\n', ' ');  // lines break at 80 columns
    return text;
  };
  // The example of --help.
  const std::string reached = summary("three_populations.toml' --vary material.skin.peak=0.45:0.6:4");
  CHECK_THAT(reached, !Contains("missed_peak") && Contains("infinite.peak"));
  const std::string missed = summary("stroke.toml' --vary material.skin.peak=0.5:0.7:5 --steps 50");
  CHECK_THAT(missed, Contains("5 of 5 rows reach another peak than their material's") &&
                         Contains("row 0: fingertip") && Contains("not its peak of 0.500"));
}

TEST_CASE("Measured times are columns of a sweep, but no part of its table's hash", "[sweep]") {
  const Folder folder;
  const std::string scene = "'" + folder.write("slide.toml", slide_scene) + "' ";
  const auto report = [&](const std::string& more) {
    const Outcome outcome = run_cli(folder, "sweep " + scene + twelve_rows + " --json - " + more);
    REQUIRE(outcome.code == 0);
    return nlohmann::json::parse(outcome.out);
  };
  const auto first = report("--report kinetic,time.cpu"), second = report("--report kinetic,time.cpu");
  CHECK(first["table_hash"] == second["table_hash"]);
  CHECK(first["columns"][5]["name"] == "time.cpu");
  CHECK(first["columns"][5]["least"].get<double>() > 0.0);
  CHECK(report("--report peak,time.cpu")["table_hash"] != first["table_hash"]);
}

// ------------------------------------------------------------------------------------ unfinished tables

TEST_CASE("A sweep's table that was cut anywhere is taken up: no row is lost, none is run twice", "[sweep]") {
  const Folder folder;
  const cli::Study study(study_options(folder.write("slide.toml", slide_scene)));
  const std::string path = folder.at("t.csv.part");
  std::vector<std::string> rows;
  {
    cli::SweepRows table(study, path);
    for (std::uint64_t i = 0; i < 4; ++i) {
      rows.push_back(study.run_row(i));
      table.add(rows.back());
      table.add(rows.back());  // a row that two workers ran counts once
    }
  }
  const std::string whole = read_file(path);
  CHECK(std::count(whole.begin(), whole.end(), '\n') == 6);
  for (std::size_t length = 0; length < whole.size(); length += 23) {
    folder.write("t.csv.part", whole.substr(0, length));
    const auto lines = std::count(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length), '\n');
    const std::uint64_t kept = lines < 2 ? 0 : static_cast<std::uint64_t>(lines) - 2;
    cli::SweepRows table(study, path);
    INFO("cut at " << length);
    REQUIRE(table.found() == kept);
    REQUIRE(table.missing().size() == 12 - kept);
    for (std::uint64_t i = 0; i < kept; ++i) REQUIRE(table.rows()[i] == rows[i]);
    for (std::uint64_t i = kept; i < 4; ++i) table.add(rows[i]);
    REQUIRE(read_file(path) == whole);
  }
}

TEST_CASE("Rows come back from a table as they were: texts with quotes and line ends, none, numbers",
          "[sweep]") {
  const Folder folder;
  cli::StudyOptions options;
  options.scene = folder.write("slide.toml", slide_scene);
  options.vary = {"scene.name=plain,\"a, b\",\"\"\"two\nlines\"\"\"", "material.wood.kinetic=0.3,-1"};
  options.report = {"kinetic", "tip.snaps", "state_hash", "steps"};
  options.steps = 300;
  const cli::Study study(options);
  const std::string path = folder.at("t.csv.part");
  std::vector<std::string> rows;
  {
    cli::SweepRows table(study, path);
    for (std::uint64_t i = study.rows(); i-- > 0;) table.add(study.run_row(i));
    rows = table.rows();
  }
  CHECK_THAT(rows[1], Contains("null"));
  const cli::SweepRows again(study, path);
  CHECK(again.found() == study.rows());
  CHECK(again.rows() == rows);
}

TEST_CASE("A sweep refuses another study's table, another file, a row that is none and a second writer",
          "[sweep]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene);
  const cli::Study study(study_options(scene));
  const std::string path = folder.at("t.csv.part");
  {
    cli::SweepRows table(study, path);
    for (std::uint64_t i = 0; i < 3; ++i) table.add(study.run_row(i));
    CHECK_THAT(message_of<UserError>([&] { cli::SweepRows(study, path); }),
               Contains("another sweep writes it"));
  }
  cli::StudyOptions other = study_options(scene);
  other.vary[0] = "material.wood.kinetic=0.3:0.44:3";
  CHECK_THAT(message_of<UserError>([&] { cli::SweepRows(cli::Study(other), path); }),
             Contains("another study"));
  CHECK_THAT(
      message_of<UserError>([&] { cli::SweepRows(study, folder.write("notes", "a line\nanother\n")); }),
      Contains("is no unfinished table"));
  CHECK(read_file(folder.at("notes")) == "a line\nanother\n");
  const std::string text = read_file(path);
  const std::string head = text.substr(0, text.find("\n0,") + 1);
  const std::string row = text.substr(head.size(), text.find("\n1,") + 1 - head.size());
  for (const std::string& bad :
       {std::string("0\n"), std::string("\n"), std::string("[0]\n"), "12" + row.substr(1), "-" + row,
        "x" + row.substr(1), row.substr(0, row.rfind(',')) + "\n", "," + row,
        row.substr(0, row.find(',') + 1) + "[[" + row.substr(row.find(',') + 1)}) {
    INFO(bad);
    folder.write("t.csv.part", head + row + bad);
    CHECK_THAT(message_of<UserError>([&] { cli::SweepRows(study, path); }), Contains(path + ":4: is no row"));
    CHECK(read_file(path) == head + row + bad);
  }

  // Checks that a comment added to the scene leaves the study's hash, and a changed number changes it.
  folder.write("slide.toml", "# a comment\n" + slide_scene);
  CHECK(cli::Study(study_options(scene)).hash() == study.hash());
  std::string changed = slide_scene;
  changed.replace(changed.find("load = 0.8"), 10, "load = 0.7");
  folder.write("slide.toml", changed);
  CHECK(cli::Study(study_options(scene)).hash() != study.hash());
}

TEST_CASE("A sweep that is killed in the middle goes on where it was, to the same table",
          "[sweep][determinism]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene), rows = folder.at("killed.csv.part");
  // Makes rows of about 10 ms, so that a signal comes when some are done and others are not.
  const std::string vary =
      " --vary material.wood.kinetic=0.3:0.45:40 --vary patch.tip.bristles=10000 --report default";
  const std::string table = table_of(folder, "'" + scene + "'" + vary);
  const int signals[] = {SIGKILL, SIGKILL, SIGINT};
  std::size_t before = 0;
  for (const int signal : signals) {
    const std::string command = "exec '" BRISTLE_CLI "' sweep '" + scene + "'" + vary +
                                " --threads 2 --out '" + folder.at("killed.csv") + "' > /dev/null 2> '" +
                                folder.at("stderr") + "'";
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
    const auto lines = [&] {
      const std::string text = read_file(rows);
      return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
    };
    for (int wait = 0; wait < 3000 && lines() < before + 5; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    before = lines();
    if (signal == SIGINT) {
      CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 130));
      CHECK_THAT(read_file(folder.at("stderr")), Contains("resume by the same command"));
    } else {
      CHECK((WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL));
    }
    CHECK(before < 42);
    CHECK_FALSE(std::filesystem::exists(folder.at("killed.csv")));
  }
  REQUIRE(before >= 15);
  const Outcome resumed =
      run_cli(folder, "sweep '" + scene + "'" + vary + " --out '" + folder.at("killed.csv") + "'");
  REQUIRE(resumed.code == 0);
  CHECK_THAT(resumed.err, Contains("of 40 rows are in"));
  CHECK_THAT(resumed.out, Contains("40 rows of scene slide") && Contains(" goes from "));
  CHECK(read_file(folder.at("killed.csv")) == table);
  CHECK_FALSE(std::filesystem::exists(rows));
}

// --------------------------------------------------- parts of a parameter study: rows, columns, reports

namespace {

std::vector<nlohmann::json> cells_of(const cli::Study& study, std::uint64_t row) {
  return nlohmann::json::parse(study.run_row(row)).get<std::vector<nlohmann::json>>();
}

/// Returns the index of the column with this name in a study's rows.
std::size_t column_of(const cli::Study& study, const std::string& name) {
  const auto& columns = study.columns();
  const auto found = std::find_if(columns.begin(), columns.end(),
                                  [&](const cli::SweepColumn& column) { return column.name == name; });
  INFO(name);
  REQUIRE(found != columns.end());
  return static_cast<std::size_t>(found - columns.begin());
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

}  // namespace

TEST_CASE("A study's recipe holds all of it, and each part of it is in its hash", "[sweep]") {
  const Folder folder, elsewhere;
  folder.write("a.csv", "t,x,load\n0,0,0.8\n0.1,1e-4,0.8\n");
  folder.write("b.csv", "t,x,load\n0,0,0.8\n0.1,2e-4,0.8\n");
  const std::string scene = replaced(replaced(slide_scene, "type = \"ramp\"\nvelocity = 1e-3\nload = 0.8\n",
                                              "type = \"trace\"\nfile = \"a.csv\"\n"),
                                     "duration = 0.3\n", "");
  cli::StudyOptions options;
  options.scene = folder.write("trace.toml", scene);
  options.vary = {"motion.tip.file=a.csv,b.csv", "material.wood.kinetic=0.3:0.4:2"};
  options.repeat = 2;
  options.seed = 7;
  options.set = {"patch.tip.bristles=100"};
  options.reference = {"patch.tip.bristles=500"};
  options.report = {"error", "window_mean", "x", "state_hash"};
  options.window = "0.02:0.08";
  options.steps = 90;
  const cli::Study study(options), copy(study.recipe(), elsewhere.path.string());
  CHECK(copy.hash() == study.hash());
  std::set<std::string> hashes;
  for (std::uint64_t row = 0; row < 8; ++row) {
    CHECK(copy.run_row(row) == study.run_row(row));
    const std::vector<nlohmann::json> cells = cells_of(copy, row);
    CAPTURE(row, cells.back());
    REQUIRE(cells.back().is_null());
    const std::size_t point = row / 2;  // rows that repeat a point follow one another
    CHECK(cells[2] == (point < 2 ? "a.csv" : "b.csv"));
    CHECK(cells[3].get<double>() == (point % 2 == 0 ? 0.3 : 0.4));
    CHECK(cells[column_of(copy, "tip.x")].get<double>() == Approx(cells[2] == "a.csv" ? 0.9e-4 : 1.8e-4));
    hashes.insert(cells[column_of(copy, "state_hash")].get<std::string>());
  }
  CHECK(hashes.size() == 8);
  const std::function<void(cli::StudyOptions&)> changes[] = {
      [](auto& o) { o.steps = 80; },        [](auto& o) { o.reference = {"patch.tip.bristles=600"}; },
      [](auto& o) { o.seed = 8; },          [](auto& o) { o.set = {"patch.tip.bristles=101"}; },
      [](auto& o) { o.window = "0:0.08"; }, [](auto& o) { o.window = "0.02:0.07"; },
      [](auto& o) { o.repeat = 3; },        [](auto& o) { o.vary[1] = "material.wood.kinetic=0.3:0.5:2"; },
      [](auto& o) { o.report.pop_back(); }};
  for (const auto& change : changes) {
    cli::StudyOptions other = options;
    change(other);
    CHECK(cli::Study(other).hash() != study.hash());
  }
}

TEST_CASE("Copies of a patch have seeds of their own, and one path", "[sweep]") {
  const Folder folder;
  const std::string two =
      replaced(slide_scene, "bristles = 200", "bristles = 200\ncount = 2") +
      "[[patch]]\nname = \"pad\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 50\n"
      "[[motion]]\npatch = \"pad\"\ntype = \"ramp\"\nvelocity = [0.0, 1e-3]\nload = 0.8\n";
  cli::StudyOptions options;
  options.scene = folder.write("two.toml", two);
  options.vary = {"material.wood.kinetic=0.3"};
  options.repeat = 2;
  options.reference = {"patch.tip.bristles=200"};
  options.report = {"all", "tip.kinetic", "kinetic"};
  options.steps = 40;
  const cli::Study study(options);
  const std::vector<nlohmann::json> cells = cells_of(study, 1);
  REQUIRE(cells.back().is_null());
  CHECK(cells[column_of(study, "tip.error")] == 0.0);
  CHECK(cells[column_of(study, "tip.x")].get<double>() == Approx(40e-6));
  CHECK(cells[column_of(study, "pad.y")].get<double>() == Approx(40e-6));
  CHECK(cells[column_of(study, "tip.snaps")].is_number_unsigned());
  CHECK(cells[column_of(study, "pad.snaps")].is_null());  // this patch does not compute energies
  std::set<std::string> names;
  for (const cli::SweepColumn& column : study.columns()) {
    CHECK_FALSE(column.measured);  // the word `all` leaves out measured times
    CHECK(names.insert(column.name).second);
  }
  options.reference = {"scene.dt=2e-3"};
  CHECK_THAT(cells_of(cli::Study(options), 0).back().get<std::string>(), Contains("must keep dt"));
}

TEST_CASE("Patches of a row that are alike in all but the seed have forces of their own", "[sweep]") {
  const Folder folder;
  const std::string patch = slide_scene.substr(slide_scene.find("[[patch]]"));
  cli::StudyOptions options;
  options.scene = folder.write(
      "two.toml", slide_scene + replaced(replaced(patch, "\"tip\"", "\"pad\""), "\"tip\"", "\"pad\""));
  options.vary = {"material.wood.kinetic=0.3"};
  options.seed = 3;
  options.report = {"fx_mean"};
  const std::vector<nlohmann::json> cells = cells_of(cli::Study(options), 0);
  REQUIRE(cells.back().is_null());
  CHECK(cells[3] != cells[4]);
}

TEST_CASE("A row has the place and the velocity of a body along both axes", "[sweep]") {
  const Folder folder;
  // Takes a body that no load presses down, so that no friction acts and each step adds force x dt / mass.
  const std::string scene =
      replaced(slide_scene.substr(0, slide_scene.find("[[motion]]")), "axes = 1", "axes = 2") +
      "[[body]]\nname = \"puck\"\nmass = 0.5\ngravity = 0.0\npatches = [\"tip\"]\n"
      "velocity = [0.25, -0.5]\nforce = [ { t = 0.0, x = 1.0, y = 3.0 } ]\n";
  cli::StudyOptions options;
  options.scene = folder.write("puck.toml", scene);
  options.vary = {"material.wood.kinetic=0.3"};
  options.report = {"puck"};
  options.steps = 100;
  const cli::Study study(options);
  const std::vector<nlohmann::json> cells = cells_of(study, 0);
  CAPTURE(cells.back());
  REQUIRE(cells.back().is_null());
  const auto value = [&](const char* name) { return cells[column_of(study, name)].get<double>(); };
  CHECK(value("puck.vx") == Approx(0.25 + 0.2));
  CHECK(value("puck.vy") == Approx(-0.5 + 0.6));
  // A step moves the body by the mean of its velocities before and after.
  CHECK(value("puck.x") == Approx(0.1 * (0.25 + 0.1)));
  CHECK(value("puck.y") == Approx(0.1 * (-0.5 + 0.3)));
  CHECK(value("puck.highest_speed") == Approx(std::hypot(0.25, 0.5)).epsilon(0.02));
}

TEST_CASE("A column has the unit of its key, and texts where a value is one", "[sweep]") {
  const Folder folder;
  const std::string scene =
      replaced(replaced(slide_scene, "velocity = 1e-3\n", "velocity = [1e-3, 0.0]\n"), "axes = 1\n",
               "axes = 2\n") +
      "[[body]]\nname = \"block\"\nmass = 0.1\npatches = [\"block\"]\nforce = [ { t = 0.0, x = 0.1 } ]\n"
      "[[patch]]\nname = \"block\"\nmaterial = \"wood\"\nmax_normal_load = 2.0\n";
  const auto column = [&](const std::string& vary) {
    cli::StudyOptions options;
    options.scene = folder.write("block.toml", scene);
    options.vary = {vary};
    options.steps = 1;
    const cli::Study study(options);
    // A body with the name of a patch.
    CHECK(column_of(study, "body.block.x") != column_of(study, "block.x"));
    return std::pair(study.columns()[1].head(), cells_of(study, 0)[1]);
  };
  CHECK(column("motion.tip.velocity.0=2e-3").first == "motion.tip.velocity.0[m/s]");
  CHECK(column("body.block.force.0.x=0.2").first == "body.block.force.0.x[N]");
  CHECK(column("body.block.mass=0.2").first == "body.block.mass[kg]");
  CHECK(column("patch.tip.bristles=100,200").second == 100);
  CHECK(column("patch.tip.bristles=100,many").second == "100");
}

TEST_CASE("A cell that holds quotes is quoted, and a failure names files as the scene does", "[sweep]") {
  const Folder folder;
  const std::string scene = folder.write("slide.toml", slide_scene);
  const std::string table =
      table_of(folder, "'" + scene + "' --vary 'material.wood.rule=\"keep\",\"redraw\"' --report x");
  CHECK_THAT(table, Contains("\n0,\"\"\"keep\"\"\",") && Contains("\n1,\"\"\"redraw\"\"\","));
  folder.write("good.csv", "t,x,load\n0,0,0.8\n0.1,1e-4,0.8\n");
  folder.write("bad.csv", "t,x,load\n0,0,0.8\n0.1,none,0.8\n");
  const std::string trace = replaced(replaced(slide_scene, "type = \"ramp\"\nvelocity = 1e-3\nload = 0.8\n",
                                              "type = \"trace\"\nfile = \"good.csv\"\n"),
                                     "duration = 0.3\n", "");
  cli::StudyOptions options;
  options.scene = folder.write("trace.toml", trace);
  options.vary = {"motion.tip.file=good.csv,bad.csv"};
  const std::string failure = cells_of(cli::Study(options), 1).back().get<std::string>();
  CHECK_THAT(failure, Contains("bad.csv:3") && !Contains(folder.path.string()));
}

}  // namespace bristle_test::test_sweep
