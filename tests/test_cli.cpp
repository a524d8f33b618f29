// The command line as a person or a program uses it: exit codes, messages, files, and physics end to end.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <sys/wait.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <bristle/patch_batch.hpp>
#include <bristle/version.hpp>

#include "command_line.hpp"
#include "temporary_folder.hpp"
#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace bristle_test::test_cli {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using nlohmann::json;

namespace {

using Folder = TemporaryFolder;

json run_report(const Folder& folder, const std::string& arguments) {
  const Outcome outcome = run_cli(folder, arguments + " --json -");
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(outcome.err.empty());
  return json::parse(outcome.out);
}

std::string scene_path(const std::string& name) { return "'" BRISTLE_SCENES "/" + name + ".toml'"; }

/// Scene of a patch in steady motion. Each member is a part of the file that a test can replace.
struct SmallScene {
  std::string scene = "[scene]\nname = \"small\"\ndt = 1e-3\nduration = 0.05\n";
  std::string material = "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n";
  std::string patch =
      "[[patch]]\nname = \"tip\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 100\n";
  std::string motion = "[[motion]]\npatch = \"tip\"\ntype = \"ramp\"\nvelocity = 0.02\nload = 1.0\n";
  std::string text() const { return scene + material + patch + motion; }
};

void replace(std::string& text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  text.replace(at, from.size(), to);
}

/// Asserts that a command is refused: exit code 2, one line on stderr with all of `parts`, nothing on stdout.
void check_refused(const Folder& folder, const std::string& arguments,
                   const std::vector<std::string>& parts) {
  const Outcome outcome = run_cli(folder, arguments);
  INFO(arguments << "\nstderr: " << outcome.err);
  CHECK(outcome.code == 2);
  CHECK(outcome.out.empty());
  CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
  for (const std::string& part : parts) CHECK_THAT(outcome.err, Contains(part));
}

}  // namespace

TEST_CASE("The sine of prescribed motions is a sine", "[cli]") {
  // Compares the trace's positions with libm, over several turns in both directions; rounding of libm's
  // argument is allowed.
  for (int i = -4000; i <= 4000; ++i) {
    const double turns = i / 1000.0;
    REQUIRE(std::abs(cli::sine_of_turns(turns) - std::sin(2.0 * M_PI * turns)) < 6e-15);
    REQUIRE(std::abs(cli::cosine_of_turns(turns) - std::cos(2.0 * M_PI * turns)) < 6e-15);
  }
  CHECK(cli::sine_of_turns(0.25) == 1.0);
  CHECK(cli::sine_of_turns(0.5) == 0.0);
  CHECK(cli::sine_of_turns(1e6 + 0.75) == -1.0);
}

TEST_CASE("The version names the build and every instruction set, and which is chosen", "[cli]") {
  const Folder folder;
  const Outcome outcome = run_cli(folder, "--version");
  CHECK(outcome.code == 0);
  CHECK_THAT(outcome.out, Contains(bristle::library_version()) && Contains("commit"));
  const bristle::PatchBatch batch;
  // Joins lines that were broken at 80 columns.
  const std::string text = std::regex_replace(outcome.out, std::regex("\n +"), " ");
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    const bool chosen = std::string(isa.name) == batch.isa();
    CHECK_THAT(text, Contains(std::string(isa.name) + (chosen       ? " (chosen)"
                                                       : isa.usable ? ""
                                                                    : " (not on this machine)")));
  }
}

TEST_CASE("A scene of beds runs, reports its forces, and is refused where it cannot go", "[cli]") {
  const Folder folder;
  const std::string csv = folder.at("beds.csv");
  const json report = run_report(folder, "run " + scene_path("wheel") + " --out '" + csv + "'");
  CHECK(report["conditions"]["threads"] == 1);
  CHECK(report["schema"] == "bristle-beds-1");
  CHECK(report["steps"] == 2500);
  const json &tyre = report["beds"][0], &finger = report["beds"][1];
  CHECK(tyre["name"] == "tyre");
  CHECK(tyre["force"]["x"]["min"] == Approx(-0.92 * 4000.0).epsilon(1e-3));
  CHECK(tyre["most_slipping"] == Approx(1.0));
  CHECK(finger["force"]["x"]["min"] == Approx(-4.0).epsilon(1e-4));
  for (const json& bed : {tyre, finger}) {
    const json& energy = bed["energy"];
    CHECK(energy["work"].get<double>() ==
          Approx(energy["dissipated"].get<double>() + energy["stored"].get<double>()).epsilon(1e-4));
  }
  const std::string rows = read_file(csv);
  CHECK(rows.rfind("t,bed,fx,fy,torque,load,", 0) == 0);
  CHECK(rows.substr(0, rows.find('\n')).find(",x,y") !=
        std::string::npos);  // all columns that tools/plots/forces.gp draws by name
  CHECK(std::count(rows.begin(), rows.end(), '\n') == 5001);
  CHECK_THAT(run_cli(folder, "run " + scene_path("wheel")).out, Contains("fingertip") && Contains("torque"));
  check_refused(folder, "run " + scene_path("wheel") + " --bristles 5", {"[[bed]]", "--threads"});
  check_refused(folder, "accuracy " + scene_path("wheel"), {"only `bristle run`"});
  const std::string head = "[scene]\nname = 'a'\ndt = 0.1\n[[bed]]\nname = 'b'\nfriction = 1\n";
  const auto work = [&](const std::string& longest_piece) {
    const std::string wheel =
        "shape = 'wheel'\nhalf = 0.05\nslip_stiffness = 80e3\nmax_normal_load = 4000\n"
        "path = [{ t = 0, load = 4000 }, { t = 1, rolled = 1, x = 0.01 }]\n";
    const std::string scene = folder.write("roll.toml", head + wheel + longest_piece);
    return run_report(folder, "run '" + scene + "'")["beds"][0]["energy"]["work"].get<double>();
  };
  // Force rises over the first contact length, so work is underestimated by 0.1 m steps in one piece.
  CHECK(work("longest_piece = 10\n") < 0.99 * work(""));
  const auto refused = [&](const std::string& bed, const std::vector<std::string>& parts) {
    check_refused(folder, "run '" + folder.write("bad.toml", head + bed) + "'", parts);
  };
  refused("max_normal_load = 1\npath = [{ t = 0, load = 1 }]", {"bad.toml:4", "shape"});
  refused("shape = 'disc'\nhalf = 1e-3\nmax_normal_load = 1\npath = [{ t = 0, load = 1 }]",
          {"'b'", "no elasticity"});
  refused("shape = 'disc'\nhalf = 1e-3\npresliding = 1e-4\nmax_normal_load = 1\npath = [{ t = 0 }]",
          {"load"});
  refused("shape = 'disc'\nmax_normal_load = 1\npath = []", {"path"});
  // A row at the time of the one above is a jump.
  const std::string pad = "shape = 'disc'\nhalf = 1e-3\npresliding = 1e-4\nmax_normal_load = 5\n";
  const std::string jump = "path = [{ t = 0, load = 1 }, { t = 0.55 }, { t = 0.55, load = 3 }, { t = 1 }]\n";
  run_report(folder, "run '" + folder.write("jump.toml", head + pad + jump) + "' --out '" + csv + "'");
  const auto jumped = csv_rows(read_file(csv));
  REQUIRE(jumped.size() == 11);
  for (std::size_t i = 1; i < jumped.size(); ++i)
    CHECK(std::stod(jumped[i][5]) == (std::stod(jumped[i][0]) < 0.55 ? 1.0 : 3.0));
  refused(pad + "path = [{ t = 1, load = 1 }, { t = 0.5 }]",
          {"bad.toml:11", "path", "comes before the row above"});
  const std::string of_patches =
      "# not a [[bed]]\n[scene]\nname = 's'\ndt = 1e-3\nduration = 0.01\n[[material]]\nname = 'm'\n"
      "[[patch]]\nname = 'p'\nmaterial = 'm'\nmax_normal_load = 1.0\n"
      "[[motion]]\npatch = 'p'\ntype = 'ramp'\nvelocity = [1e-3, 0.0]\nload = 1.0\n";
  CHECK(run_report(folder, "run '" + folder.write("patches.toml", of_patches) + "'")["schema"] ==
        "bristle-run-1");
}

TEST_CASE("A scene of joints reports torques and work, and refuses what no joint has by key and line",
          "[cli]") {
  const Folder folder;
  const std::string csv = folder.at("arm.csv");
  const json report = run_report(folder, "run " + scene_path("arm") + " --csv '" + csv + "'");
  CHECK(report["conditions"]["threads"] == 1);
  CHECK(report["schema"] == "bristle-joints-1");
  CHECK(report["steps"] == 2500);
  const json &shoulder = report["joints"][0], &wrist = report["joints"][1];
  // Lifting at 0.5 rad/s the motor drives, lowering it is driven; 20 N m are motor torque.
  CHECK(shoulder["torque"]["max"].get<double>() == Approx(0.8 + 0.12 * 20.0 + 0.2 * 0.5).epsilon(0.02));
  CHECK(wrist["torque"]["min"].get<double>() == Approx(-0.1).epsilon(1e-6));
  // Over 1 rad the wrist loses 0.1 J, less what bends its springs: at most 0.1 N m over 2 x 60 N m/rad each.
  CHECK(wrist["work"].get<double>() == Approx(0.1).margin(2e-4));
  const std::string rows = read_file(csv);
  CHECK(rows.rfind("t,joint,torque,mean,angle,motor,outside,status\n", 0) == 0);
  CHECK(std::count(rows.begin(), rows.end(), '\n') == 5001);
  CHECK_THAT(run_cli(folder, "run " + scene_path("arm")).out, Contains("shoulder") && Contains("work"));
  check_refused(folder, "run " + scene_path("arm") + " --bristles 5", {"[[joint]]", "--threads"});
  check_refused(folder, "accuracy " + scene_path("arm"), {"only `bristle run`", "[[joint]]"});
  const auto refused = [&](const std::string& joint, const std::vector<std::string>& parts) {
    const std::string head = "[scene]\nname = 'a'\ndt = 0.1\n[[joint]]\nname = 'j'\n";
    check_refused(folder, "run '" + folder.write("bad.toml", head + joint) + "'", parts);
  };
  refused("path = [{ t = 0 }]", {"bad.toml:4", "stiffness"});
  refused("stiffness = -1\npath = [{ t = 0 }]", {"bad.toml:6", "stiffness"});
  refused("stiffness = 1\nmotor = [0.1]\npath = [{ t = 0 }]", {"motor", "while it drives"});
  refused("stiffness = 1\nstatic_bse = 1\npath = [{ t = 0 }]", {"static_bse", "static_base"});
  refused("stiffness = 1\npath = []", {"path"});
}

TEST_CASE("A run reports what the documentation says it does", "[cli]") {
  if (!BRISTLE_WITH_DOUBLE) return;  // one patch of this scene has double precision
  const Folder folder;
  const json report =
      run_report(folder, "run " + scene_path("two_surfaces") + " --out '" + folder.at("f.csv") + "'");
  CHECK(report["schema"] == "bristle-run-1");
  for (const char* key : {"version", "commit", "flags", "cpu", "cores", "isa", "threads"}) {
    CHECK(report["conditions"].contains(key));
  }
  CHECK(report["conditions"]["threads"] == 1);
  CHECK(report["steps"] == 3000);
  CHECK(report["simulated_s"] == Approx(3.0));
  for (const char* key : {"p50_s", "p99_s", "p999_s", "max_s", "mean_s"})
    CHECK(report["step_time"][key] > 0.0);
  CHECK(report["step_time"]["p50_s"] <= report["step_time"]["p99_s"]);
  CHECK(report["step_time"]["p99_s"] <= report["step_time"]["p999_s"]);
  CHECK(report["deadline"]["deadline_s"] == 1e-3);
  CHECK(report["deadline"]["misses"] ==
        report["deadline"]["misses_ours"].get<int>() + report["deadline"]["misses_machine"].get<int>());
  CHECK(report["bristles"] == 5500);
  CHECK(report["state_hash"].get<std::string>().size() == 16);
  REQUIRE(report["patches"].size() == 2);
  for (const json& patch : report["patches"]) {
    for (const char* key : {"name", "count", "kernel", "left_out", "bristles", "weight", "memory_bytes",
                            "load", "force", "mean_force", "coefficient", "energy", "status"}) {
      CHECK(patch.contains(key));
    }
    CHECK(patch["status"]["bad_input"] == 0);
    CHECK(patch["energy"]["snaps"] > 0);
  }
  const auto rows = csv_rows(read_file(folder.at("f.csv")));
  REQUIRE(rows.size() == 1 + 2 * 3000);
  CHECK(rows[0] == std::vector<std::string>{"t", "patch", "fx", "fy", "load", "bristles", "status", "mean_fx",
                                            "mean_fy", "snaps", "dissipated", "contact_loss", "damper_work",
                                            "x", "y"});
  CHECK(rows[1][1] == "steel_pad");
  CHECK(rows[2][1] == "rubber_pad");
  CHECK(rows[1][6] == "ok");
}

TEST_CASE("The table repeats what files say in short lines that no terminal obeys", "[cli]") {
  const Folder folder;
  SmallScene s;
  replace(s.scene, "dt =", "description = \"\\u001b]0;x\\u0007" + std::string(1'000'000, 'd') + "\"\ndt =");
  const std::string scene = folder.write("small.toml", s.text());
  const std::string trace = folder.write("\x1b[31m.csv", "t,x,load,\x1b[31m" + std::string(1'000'000, 'c') +
                                                             ",last\n0,0,1,2,3\n0.01,1e-4,1,2,3\n");
  const Outcome outcome = run_cli(folder, "run '" + scene + "' --wide --trace '" + trace + "'");
  REQUIRE(outcome.code == 0);
  CHECK(outcome.out.find('\x1b') == std::string::npos);
  CHECK(outcome.out.size() < 5000);
  CHECK_THAT(outcome.out, Contains("scene       small: ?]0;x?ddd") && Contains("?[31m.csv: 2 rows over") &&
                              Contains("columns not used: ?[31mccc") && Contains("ccc, last\n"));
}

TEST_CASE("The block breaks away at the peak and slides at the kinetic coefficient", "[cli][physics]") {
  const Folder folder;
  const json report = run_report(folder, "run " + scene_path("block_on_floor"));
  const json& coefficient = report["patches"][0]["coefficient"];
  // One sample of the sliding force of zeta bristles spreads by less than 0.7 / sqrt(zeta) (SnapRule::redraw,
  // cv 0.3: sqrt(m3 / (3 m1) - (m2 / (2 m1))^2) / (m2 / (2 m1))). Here zeta = 2206, and at least a hundred
  // samples are a snap length apart. Allows five deviations.
  REQUIRE(coefficient["sliding_steps"] > 100);
  CHECK(coefficient["sliding"].get<double>() == Approx(0.40).epsilon(5 * 0.7 / std::sqrt(2206.0 * 100)));
  // At first loading stratified snap lengths are nearly exact; the tolerance is for a peak between two ticks.
  CHECK(coefficient["highest"].get<double>() == Approx(0.46).epsilon(5e-3));
  // Checks that the block's work goes into snaps, dampers and bent bristles alone, in single precision.
  const json& energy = report["patches"][0]["energy"];
  CHECK(std::abs(energy["balance_error"].get<double>()) < 1e-6 * energy["work"].get<double>());
  const json& body = report["bodies"][0];
  CHECK(std::abs(body["velocity"][0].get<double>()) < 1e-9);
  CHECK(body["solver"]["worst_evaluations"] < 20);
}

TEST_CASE("A trace replaces the motion of a scene and sets its length", "[cli]") {
  const Folder folder;
  const std::string scene = folder.write("small.toml", SmallScene{}.text());
  const std::string trace =
      folder.write("hand.csv", "t[ms],x[um],load[mN],button\n10,0,500,0\n20,100,500,1\n30,100,1000,1\n");
  const json report =
      run_report(folder, "run '" + scene + "' --trace '" + trace + "' --out '" + folder.at("f.csv") + "'");
  CHECK(report["steps"] == 20);
  CHECK(report["traces"][0]["rows"] == 3);
  CHECK(report["traces"][0]["ignored_columns"] == json::array({"button"}));
  const auto rows = csv_rows(read_file(folder.at("f.csv")));
  REQUIRE(rows.size() == 21);
  const std::size_t x = rows[0].size() - 2;
  // Position halfway between two rows of the trace (an input file of positions), linear in between.
  CHECK(std::stod(rows[5][x]) == Approx(50e-6));
  CHECK(std::stod(rows[10][x]) == Approx(100e-6));
  CHECK(std::stod(rows[20][x]) == Approx(100e-6));
  CHECK(std::stod(rows[5][4]) == Approx(0.5));
  CHECK(std::stod(rows[15][4]) == Approx(0.75));
  CHECK(std::stod(rows[20][4]) == Approx(1.0));
}

TEST_CASE("A scene's material has residual and shared renewal, by coefficients or by bristle parameters",
          "[cli][rubbing]") {
  SmallScene small;
  replace(small.patch, "bristles = 100", "population = \"infinite\"");
  replace(small.material, "presliding", "residual_share = 0.2\nshared_renewal = 1.5\npresliding");
  const cli::SceneMaterial coefficients = cli::parse_scene(small.text(), "small.toml").materials.at(0);
  CHECK(coefficients.material.residual_length == Approx(0.2e-5));
  CHECK(coefficients.material.snap_length.mean() == Approx(0.8e-5));
  CHECK(coefficients.material.shared_renewal == 1.5);
  CHECK(coefficients.material.peak_coefficient() == Approx(0.46).epsilon(1e-6));

  replace(small.material, "residual_share = 0.2", "residual_length = 3e-6");
  replace(small.material, "presliding_length = 1e-5", "bristle_stiffness = 10");
  const cli::SceneMaterial parameters = cli::parse_scene(small.text(), "small.toml").materials.at(0);
  CHECK(parameters.material.residual_length == 3e-6);
  CHECK(parameters.material.shared_renewal == 1.5);

  const Folder folder;
  replace(small.material, "residual_length", "residual_share");
  check_refused(folder, "run '" + folder.write("mixed.toml", small.text()) + "'", {"mixes coefficients"});
  replace(small.material, "bristle_stiffness = 10", "kinetic = 0.4");
  replace(small.material, "residual_share = 3e-6", "residual_share = 0.99");
  check_refused(folder, "run '" + folder.write("share.toml", small.text()) + "'", {"residual_share is 0.99"});
}

TEST_CASE("A state that cannot be saved at the end costs no report", "[cli][state]") {
  const Folder folder;
  const std::string scene = folder.write("small.toml", SmallScene{}.text());
  // Limits files to a kilobyte, so that saving fails: the state of a hundred bristles is larger.
  const std::string script =
      folder.write("limited.sh", "set -o pipefail\n(trap '' XFSZ; ulimit -f 1; '" BRISTLE_CLI "' run '" +
                                     scene + "' --save-state '" + folder.at("state") + "' --json - 2>'" +
                                     folder.at("err") + "') | cat >'" + folder.at("out") + "'\n");
  const int status = std::system(("bash '" + script + "'").c_str());
  CHECK(WEXITSTATUS(status) == 2);
  CHECK(json::parse(read_file(folder.at("out")))["steps"] == 50);
  const std::string message = read_file(folder.at("err"));
  CHECK_THAT(message, Contains(folder.at("state") + ": cannot be written"));
  CHECK(std::count(message.begin(), message.end(), '\n') == 1);
  CHECK_FALSE(std::filesystem::exists(folder.at("state")));
}

TEST_CASE("Copies of a patch are stepped together and the force file says how many it holds", "[cli]") {
  const Folder folder;
  const json report = run_report(
      folder, "run " + scene_path("many_contacts") + " --steps 20 --out '" + folder.at("f.csv") + "'");
  CHECK(report["patch_count"] == 10000);
  CHECK(report["bristles"] == 1000000);
  CHECK(report["forces"]["patches"] == 8);
  const auto rows = csv_rows(read_file(folder.at("f.csv")));
  CHECK(rows.size() == 1 + 8 * 20);
  CHECK(rows[8][1] == "grain.7");
}

TEST_CASE("A scene that is not right is refused in one line with file, line and key", "[cli][bad input]") {
  const Folder folder;
  // Cases of wrong scenes: part of the scene file, text in it, its replacement, and parts of the message
  // (none if the scene is valid).
  const char* const cases = R"(
patch    | bristles              | bristels            | :12: [[patch]] 'tip': unknown key 'bristels' | bristles
motion   | [[motion]]            | [[movement]]        | :13: unknown key 'movement'
patch    | bristles = 100        | population = "finite" | :12: [[patch]] 'tip': population is 'finite' | representatives | infinite
patch    | bristles = 100        | population = "infinite"; resolution = 0.5 | :13: [[patch]] 'tip': resolution is 0.5; allowed: 0 (automatic), or 1 to 128
patch    | bristles = 100        | population = "representatives"; resolution = 8 | :13: [[patch]] 'tip': resolution is for population = "infinite"
scene    | dt = 1e-3             | dt = 0              | :3: [scene] 'small': dt is 0 | more than 0
scene    | dt = 1e-3             | dt = -1.0           | :3: | dt is -1
scene    | dt = 1e-3             |                     | [scene] 'small': key 'dt' is missing
motion   | load = 1.0            | load = nan          | :17: [[motion]]: load is nan | at least 0
motion   | load = 1.0            | load = inf          | load is inf
motion   | load = 1.0            | load = -1           | load is -1
motion   | velocity = 0.02       | velocity = "fast"   | :16: [[motion]]: velocity is 'fast'; a number is needed
motion   | velocity = 0.02       | velocity = [1, 2, 3] | velocity holds 3 numbers
motion   | "ramp"                | "ramps"             | type is 'ramps' (did you mean 'ramp'?); allowed: hold, ramp, sine, keyframes, trace
motion   | velocity = 0.02       | amplitude = 0.02    | unknown key 'amplitude'
patch    | "wood"                | "would"             | material names 'would' | allowed: wood
motion   | "tip"                 | "top"               | patch names 'top' | allowed: tip
patch    | bristles = 100        | bristles = 100000000000 | bristles is 100000000000 | 67108864
patch    | bristles = 100        | bristles = 100.5    | bristles is 100.5; a whole number
patch    | bristles = 100        | axes = 3            | axes is 3
patch    | bristles = 100        | axes = 1            |
material | presliding            | peak = 2.0; presliding | [[material]] 'wood' | peak
material | presliding            | bristle_stiffness = 10; presliding | mixes coefficients
patch    | bristles = 100        | outputs = ["end", "median"] | outputs holds 'median'
material | [[material]]          | [[material]]; name = "wood"; [[material]] | name 'wood' appears twice
motion   | [[motion]]; patch = "tip"; type = "ramp"; velocity = 0.02; load = 1.0 | | [[patch]] 'tip' | nothing moves it
scene    | [scene]               | [[[[scene]          | :1: | not TOML
scene    | duration = 0.05       |                     | key 'duration' is missing
motion   | type = "ramp"; velocity = 0.02 | type = "trace"; file = "gone.csv" | gone.csv: cannot be read
motion   | load = 1.0            | load = 1.0; [[body]]; name = "block"; mass = 1.0; patches = ["tip"] | :21: [[body]] 'block': patches names 'tip' | moves already
)";
  std::istringstream lines(cases + 1);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    for (std::size_t at = 0, end = 0; end != std::string::npos; at = end + 1) {
      end = line.find('|', at);
      const std::string cell = line.substr(at, end - at);
      const std::size_t from = cell.find_first_not_of(' ');
      cells.push_back(from == std::string::npos ? ""
                                                : cell.substr(from, cell.find_last_not_of(' ') + 1 - from));
    }
    SmallScene s;
    std::string& part = cells[0] == "scene"      ? s.scene
                        : cells[0] == "material" ? s.material
                        : cells[0] == "patch"    ? s.patch
                                                 : s.motion;
    const std::regex new_line("; ");
    replace(part, std::regex_replace(cells[1], new_line, "\n"), std::regex_replace(cells[2], new_line, "\n"));
    INFO(line);
    const std::string path = folder.write("bad.toml", s.text());
    std::vector<std::string> parts(cells.begin() + 3, cells.end());
    if (parts.front().empty()) {
      CHECK(run_cli(folder, "run '" + path + "'").code == 0);
      continue;
    }
    if (parts.front() != "gone.csv: cannot be read") parts.push_back("bristle: " + path);
    check_refused(folder, "run '" + path + "'", parts);
  }
}

TEST_CASE("A patch of a scene has the lay that its table says", "[cli][lay]") {
  const Folder folder;
  SmallScene s;
  const auto sliding = [&] {
    return run_report(folder, "run '" + folder.write("lay.toml", s.text()) +
                                  "'")["patches"][0]["coefficient"]["sliding"]
        .get<double>();
  };
  replace(s.patch, "bristles = 100", "population = \"infinite\"\nlay = { limit_ratio = 1.0 }");
  const double plain = sliding();
  // The patch moves along x, across the lay of the surface, which is turned by 90 degrees.
  replace(s.patch, "limit_ratio = 1.0", "limit_ratio = 0.25, angle = 1.5707963267948966");
  CHECK(sliding() == Approx(0.25 * plain).epsilon(0.01));
  replace(s.patch, "limit_ratio = 0.25", "to_over_fro = 2.0");
  check_refused(folder, "run '" + folder.write("lay.toml", s.text()) + "'",
                {"lay.toml", "lay", "is refused", "lay.to_over_fro = 2", "SnapRule::slide"});
  replace(s.patch, "to_over_fro", "too_over_fro");
  check_refused(folder, "run '" + folder.write("lay.toml", s.text()) + "'", {"too_over_fro", "to_over_fro"});
}

TEST_CASE("An infinite patch in a scene slides with the kinetic coefficient, and the run names it", "[cli]") {
  const Folder folder;
  SmallScene s;
  replace(s.patch, "bristles = 100", "population = \"infinite\"");
  const std::string path = folder.write("infinite.toml", s.text());
  const json report = run_report(folder, "run '" + path + "'");
  const json& patch = report["patches"][0];
  CHECK(patch["population"] == "infinite");
  CHECK(patch["resolution"] == 8.0);
  CHECK(patch["bristles"].is_null());
  CHECK(report["bristles"] == 0);
  CHECK(patch["coefficient"]["sliding"].get<double>() == Approx(0.40).epsilon(0.005));
  SmallScene both = s;
  replace(both.patch, "population = ", "bristles = 100\npopulation = ");
  const std::string beside = folder.write("both.toml", both.text());
  CHECK(run_report(folder, "run '" + beside + "'")["state_hash"] == report["state_hash"]);
  CHECK_THAT(run_cli(folder, "run --wide '" + beside + "'").out, Contains("(bristles = 100 unused)"));

  replace(s.patch, "population = \"infinite\"", "population = \"infinite\"\nresolution = 16");
  const json finer = run_report(folder, "run '" + folder.write("finer.toml", s.text()) + "'");
  CHECK(finer["patches"][0]["resolution"] == 16.0);
  CHECK(finer["patches"][0]["memory_bytes"] != patch["memory_bytes"]);
  CHECK(finer["state_hash"] != report["state_hash"]);
  replace(s.patch, "population = \"infinite\"\nresolution = 16", "bristles = 100");
  const json representatives = run_report(folder, "run '" + folder.write("n.toml", s.text()) + "'");
  CHECK(representatives["patches"][0]["population"] == "representatives");
  CHECK(representatives["patches"][0]["resolution"].is_null());
  CHECK(representatives["bristles"] == 100);
}

TEST_CASE("A law too wide for representatives is refused at the material, and infinite takes it",
          "[cli][bad input]") {
  const Folder folder;
  SmallScene s;
  s.material =
      "[[material]]\nname = \"wood\"\nsnap_length = { law = \"lognormal\", mean = 1e-5, cv = 2.0 }\n";
  check_refused(
      folder, "run '" + folder.write("wide.toml", s.text()) + "'",
      {":5: [[material]] 'wood': Material: snap_length.cv = 2", "1.25", "keep", "infinite", "'tip'"});
  replace(s.patch, "bristles = 100", "population = \"infinite\"");
  CHECK(run_cli(folder, "run '" + folder.write("wide.toml", s.text()) + "'").code == 0);
  s.material += "rule = \"keep\"\n";
  check_refused(folder, "run '" + folder.write("wide.toml", s.text()) + "'",
                {":13: [[patch]] 'tip': population is 'infinite'", "keep", "redraw", "representatives"});
  replace(s.patch, "population = \"infinite\"", "bristles = 100");
  CHECK(run_cli(folder, "run '" + folder.write("wide.toml", s.text()) + "'").code == 0);
}

TEST_CASE("Motion along y on a patch with one axis is refused", "[cli][bad input]") {
  const Folder folder;
  SmallScene s;
  replace(s.patch, "bristles = 100", "axes = 1");
  replace(s.motion, "velocity = 0.02", "velocity = [0.0, 0.02]");
  check_refused(folder, "run '" + folder.write("bad.toml", s.text()) + "'", {"moves along y", "axes = 1"});
}

TEST_CASE("A run draws its forces, and writes them and its report into a page", "[cli]") {
  const Folder folder;
  const std::string scene = "run '" + folder.write("small.toml", SmallScene{}.text()) + "'";
  const std::string png = folder.at("f.png"), svg = folder.at("f.svg"), page = folder.at("f.html");
  const Outcome both = run_cli(
      folder, scene + " --plot '" + png + "' --html '" + page + "' --csv '" + folder.at("f.csv") + "'");
  INFO(both.err);
  REQUIRE(both.code == 0);
  REQUIRE(run_cli(folder, scene + " --plot '" + svg + "'").code == 0);
  CHECK(read_file(png).substr(1, 3) == "PNG");
  CHECK_THAT(read_file(svg), Contains("<svg") && Contains("small"));
  CHECK_THAT(read_file(page), Contains("tip slides at 0.4") && Contains("data:image/png;base64,iVBORw0KGgo"));
  CHECK(csv_rows(read_file(folder.at("f.csv"))).size() == 51);
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder.path))
    files += file.path().filename().string().starts_with("f.");
  CHECK(files == 4);  // none unfinished
}

TEST_CASE("A load above a patch's maximum is said first", "[cli]") {
  const Folder folder;
  SmallScene s;
  const auto answer = [&] { return run_cli(folder, "run '" + folder.write("s.toml", s.text()) + "'").out; };
  CHECK_THAT(answer(), !Contains("OVERLOAD"));
  replace(s.motion, "load = 1.0", "load = 1.5");
  CHECK_THAT(answer(), StartsWith("OVERLOAD of tip in every step: up to 1.5 N on a max_normal_load of 1 N"));
  replace(s.motion, "load = 1.5", "load_steps = [{ t = 0, load = 0.5 }, { t = 0.04, load = 1.5 }]");
  CHECK_THAT(answer(), StartsWith("OVERLOAD of tip in 10 of 50 steps"));
}

TEST_CASE("A peak is reached, or the run says which one was and why", "[cli]") {
  const Folder folder;
  SmallScene s;
  replace(s.patch, "bristles = 100", "population = \"infinite\"");
  replace(s.material, "presliding", "peak = 0.5\npresliding");
  const auto coefficient = [&] {
    return run_report(folder, "run '" + folder.write("s.toml", s.text()) + "'")["patches"][0]["coefficient"];
  };
  // Takes steps of two mean snap lengths, whose ends miss the peak of friction.
  json found = coefficient();
  CHECK(found["highest"].get<double>() < 0.45);
  CHECK_THAT(found["missed_peak"].get<std::string>(),
             StartsWith("tip reaches 0.4") && Contains("not its peak of 0.500") &&
                 Contains("steps of up to 2.2 mean snap lengths") && Contains("a dt of 9.00 us shows it"));
  CHECK_THAT(run_cli(folder, "run '" + folder.at("s.toml") + "'").out, Contains("not its peak of 0.500"));
  replace(s.scene, "dt = 1e-3", "dt = 9e-6");
  found = coefficient();
  CHECK(found["missed_peak"].is_null());
  CHECK(found["highest"].get<double>() == Approx(0.5).epsilon(0.02));
  // Pushes that end before the peak: one stops after 4 um, one turns back there.
  replace(s.motion, "velocity = 0.02", "velocity = 0.02\nuntil = 2e-4");
  CHECK_THAT(coefficient()["missed_peak"].get<std::string>(),
             Contains("went no farther than 4") && Contains("the peak comes within 10 um"));
  s.motion =
      "[[motion]]\npatch = \"tip\"\ntype = \"keyframes\"\nload = 1.0\nkeyframes = [{ t = 0, x = 0 }, "
      "{ t = 0.01, x = 4e-6 }, { t = 0.02, x = 0 }]\n";
  CHECK_THAT(coefficient()["missed_peak"].get<std::string>(), Contains("turned back after 4"));
  s.motion =
      "[[motion]]\npatch = \"tip\"\ntype = \"ramp\"\nvelocity = 1e-3\n"
      "load_steps = [ { t = 0, load = 0.2 }, { t = 2e-3, load = 1.0 } ]\n";
  CHECK_THAT(coefficient()["missed_peak"].get<std::string>(), Contains("the load rose from 0.2 to 1 N"));
  // Few bristles ripple over the peak.
  s = {};
  replace(s.patch, "bristles = 100", "bristles = 10\nseed = 3");
  replace(s.scene, "duration = 0.05", "duration = 0.5");
  CHECK_THAT(coefficient()["missed_peak"].get<std::string>(),
             Contains("more than its peak") && Contains("its 10 bristles ripple"));
  // Under a constant load an exceeded peak is not laid to the load.
  s = {};
  replace(s.scene, "duration = 0.05", "duration = 2");
  replace(s.material, "presliding",
          "kinetic = 0.28\nspread = 0.5\nresidual_share = 0\nshared_renewal = 0\npresliding");
  replace(s.patch, "bristles = 100", "population = \"infinite\"");
  replace(s.motion, "\"ramp\"\nvelocity = 0.02", "\"sine\"\namplitude = 2e-3\nfrequency = 0.9");
  CHECK_THAT(coefficient()["missed_peak"].get<std::string>(),
             Contains("after a reversal it rises higher") && !Contains("its load changes"));
}

TEST_CASE("Arguments that are not right are refused in one line", "[cli][bad input]") {
  const Folder folder;
  const std::string scene = "'" + folder.write("small.toml", SmallScene{}.text()) + "'";
  check_refused(folder, "walk", {"'walk' is not a command", "run, capacity"});
  check_refused(folder, "rnu", {"did you mean 'run'"});
  check_refused(folder, "run", {"SCENE", "see bristle run --help"});
  check_refused(folder, "run " + scene + " --fast", {"'--fast' is not an option of bristle run"});
  check_refused(folder, "run " + scene + " --treads=2", {"did you mean '--threads'"});
  check_refused(folder, "experiment stick", {"'stick' is not an experiment (did you mean 'stick-slip'?)"});
  check_refused(folder, "run " + scene + " --plot a.jpg", {"a.jpg: pictures are PNG or SVG"});
  check_refused(folder, "run " + scene_path("wheel") + " --plot a.png", {"[[bed]]", "other options do not"});
  check_refused(folder, "stability --plot=a.png", {"stability.gp draws what --csv writes"});
  check_refused(folder, "experiment drift --plot a.jpg", {"a.jpg: pictures are PNG or SVG"});
  check_refused(folder, "fit data.csv --plot a.jpg", {"a.jpg: pictures are PNG or SVG"});
  check_refused(folder, "fit " + scene, {"is a scene", "bristle run"});
  check_refused(folder, "run " + scene + " --threads -1", {"--threads"});
  check_refused(folder, "run " + scene + " --clip-load", {"--clip-load needs NUMBER, 0 to 1000000000 (see"});
  check_refused(folder, "run " + scene + " --steps 0", {"--steps"});
  check_refused(folder, "run " + scene + " --isa zx81", {"zx81"});
  check_refused(folder, "run '" + folder.at("none.toml") + "'",
                {folder.at("none.toml") + ": cannot be read"});
  check_refused(folder, "run '" + folder.path.string() + "'", {"cannot be read"});
  check_refused(folder, "run " + scene + " --out '" + folder.at("none/f.csv") + "'", {"cannot be written"});
  check_refused(folder, "run " + scene + " --json '" + folder.at("none/r.json") + "'", {"cannot be written"});
  check_refused(folder, "run " + scene + " --json - --out -", {"stdout"});
  check_refused(folder, "run " + scene + " --save-state -", {"--save-state -", "name a file"});
  check_refused(folder, "run " + scene + " --save-state '" + folder.at("none/state") + "'",
                {folder.at("none/state") + ": cannot be written"});
  check_refused(folder, "fit data.csv --load nan", {"--load is 'nan'"});
  check_refused(folder, "fit data.csv --load 2m", {"--load is '2m'", "mN"});
  for (const char* const option : {"--load 2N", "--clip-load 5mN", "--sign on", "--rule redraw"})
    check_refused(folder, "fit data.csv --joint " + std::string(option),
                  {std::string(option).substr(0, std::string(option).find(' ')), "of a contact"});
  check_refused(folder, "accuracy " + scene + " --seconds -nan", {"--seconds: '-nan'; allowed"});
  check_refused(folder, "accuracy " + scene + " --error 0%", {"--error is '0%'", "allowed: 0.0001% to 100%"});
  check_refused(folder, "accuracy " + scene + " --error good", {"--error is 'good'"});
  check_refused(folder, "accuracy " + scene + " --error 1", {"--error is '1'", "with its unit: 1%"});
  check_refused(folder, "accuracy " + scene + " --json - --csv -", {"only one can have stdout"});
  check_refused(folder, "capacity --deadline 0", {"--deadline"});
  check_refused(folder, "capacity --deadline 1", {"--deadline is '1'", "with its unit: 1ms"});
  check_refused(folder, "capacity --deadline soon", {"--deadline"});
  check_refused(folder, "capacity --deadline 1ms --threads 0", {"--threads"});
  check_refused(folder, "capacity --targets --csv x.csv", {"--csv", "--targets"});
  check_refused(folder, "stability --threads -1", {"--threads"});
  check_refused(folder, "stability --population finite",
                {"--population", "finite", "representatives", "infinite"});
  check_refused(folder, "stability --rule slip", {"--rule is 'slip'", "redraw, keep, slide"});
  check_refused(folder, "stability --quick --rule slide --population infinite",
                {"infinite", "SnapRule::slide"});
  check_refused(folder, "stability --json - --csv -", {"--json -", "--csv -", "stdout"});
  check_refused(folder, "stability --csv /no/such/folder/map.csv", {"/no/such/folder/map.csv"});
  for (const char* const says_nothing :
       {"fit data.csv --columns x=1,x=2", "fit data.csv --units x=um,x=mm", "capacity --threads 1,,2",
        "capacity --threads 1,", "run SCENE --trace ''", "run SCENE --out ''", "run ''",
        "accuracy SCENE --csv ''"})
    check_refused(folder, std::regex_replace(says_nothing, std::regex("SCENE"), scene), {});
}

TEST_CASE("A run says when a body broke away, and how long it stuck", "[cli]") {
  const Folder folder;
  const json body = run_report(folder, "run " + scene_path("block_on_floor"))["bodies"][0];
  // Expects a slip: the push rises to 1.3 N in 0.6 s from 1.4 s on, past the 0.46 x 2.45 N that the block
  // holds. The block moves by a snap length within 17 ms.
  CHECK(body["broke_away_n"].get<double>() == Approx(0.46 * 0.25 * 9.80665).epsilon(0.04));
  CHECK(body["broke_away_s"].get<double>() == Approx(1.4 + 0.6 * 0.46 * 0.25 * 9.80665 / 1.3).margin(0.02));
  CHECK(body["stuck_s"] > 2.0);
  CHECK(body["stuck_s"] < 3.8);
  const std::string text = run_cli(folder, "run " + scene_path("block_on_floor")).out;
  CHECK_THAT(text, StartsWith("A step of block_on_floor takes ") && Contains("late") &&
                       Contains("base slides at 0.400 of its load (theory 0.400)") &&
                       Contains("block breaks away after 1.9") && Contains("and sticks for"));
  CHECK_FALSE(Contains("fy mean").match(text));  // a patch of one axis has no column for the force along y

  // Friction without a peak rises to its kinetic value, 0.275 x 5 N, over two mean snap lengths.
  const std::string smooth = folder.write("smooth.toml",
                                          "[scene]\nname = \"smooth\"\ndt = 1e-3\nduration = 16.0\n"
                                          "[[material]]\nname = \"m\"\nkinetic = 0.275\nspread = 0.6\n"
                                          "presliding_length = 50e-6\ndamping_per_newton = 4\n"
                                          "[[patch]]\nname = \"p\"\nmaterial = \"m\"\naxes = 1\n"
                                          "max_normal_load = 5.1\n[[body]]\nname = \"b\"\nmass = 0.50986\n"
                                          "patches = [\"p\"]\nforce = [{ t = 0.0, x = 0.0 }, "
                                          "{ t = 16.0, x = 1.6 }]\n");
  const json slow = run_report(folder, "run " + smooth)["bodies"][0];
  CHECK(slow["broke_away_n"].get<double>() == Approx(1.375).epsilon(0.02));
}

TEST_CASE("Capacity reports the paper's 900, loops side by side, and bristles that fit", "[cli]") {
  const Folder folder;
  const json report = run_report(
      folder, "capacity --quick --threads 1 --deadline 20us --csv '" + folder.at("capacity.csv") + "'");
  CHECK(report["schema"] == "bristle-capacity-1");
  CHECK(report["deadline_s"] == Approx(20e-6));
  CHECK(report["paper"]["bristles"] == 900);
  REQUIRE(report["capacities"].size() > 3);
  std::vector<std::string> sliding;  // kernels and layouts of the rows with a path that turns
  for (const json& row : report["capacities"]) {
    for (const char* key : {"motion", "kernel", "layout", "threads", "bristles", "at_capacity", "curve"}) {
      CHECK(row.contains(key));
    }
    if (row["bristles"] > 0 && !row["more_would_fit"])
      CHECK(row["at_capacity"]["p99_s"].get<double>() <= 20e-6);
    if (row["motion"] == "turning")
      sliding.push_back(row["kernel"].get<std::string>() + ", " + row["layout"].get<std::string>());
  }
  CHECK(sliding == std::vector<std::string>{"2 axes, slide, end, single, patches of 32"});
  // Expects rows for rest, tremor, three straight slides, a zigzag, two bends, three motions under a load
  // that ripples and four with right angles, for one patch and for a hundred.
  REQUIRE(report["infinite"].size() == 2 * (2 + 3 + 1 + 2 + 3 + 4));
  for (const json& row : report["infinite"]) {
    CHECK(row["resolution"] == 8);
    CHECK((row["patches"] == 1 || row["patches"] == 100));
    CHECK(row["p99_s"] > 0.0);
    CHECK(row["kernel"] == "default material, 2 axes, infinite, end, single");
    CHECK(row["ns_per_patch"] > 0.0);
    CHECK(row["bytes_per_patch"] > 0);
  }
  REQUIRE(report["snapshots"].size() == 4);
  for (const json& row : report["snapshots"]) {
    INFO(row);
    CHECK(row["batch_bytes"] == bristle::PatchBatch(bristle::BatchOptions{}).state_size());
    CHECK(row["state_bytes"] > 12 * (row["contact"] == "1,000 bristles" ? 1000 : 100));
    CHECK(row["memory_bytes"] > row["state_bytes"]);
    CHECK(row["save_s"] > 0.0);
    CHECK(row["restore_s"] > 0.0);
  }
  REQUIRE(report["contacts"].size() == 4);
  for (const json& row : report["contacts"])
    if (row["bristles"] > 0) CHECK(row["at_capacity"]["p99_s"].get<double>() <= 20e-6);
  for (const json& row : report["comparisons"]) {
    CHECK(row["ns_per_bristle"] > 0.0);
    CHECK(row["quartiles"][0] <= row["time_over_bristle"]);
    CHECK(row["time_over_bristle"] <= row["quartiles"][1]);
  }
  const auto points = csv_rows(read_file(folder.at("capacity.csv")));
  CHECK(points[0] == std::vector<std::string>{"motion", "kernel", "layout", "threads", "bristles", "p50_us",
                                              "p99_us", "max_us", "ns_per_bristle", "deadline_us"});
  const json& first = report["capacities"][0]["curve"][0];
  REQUIRE(points.size() > report["capacities"].size());
  CHECK(points[1][0] == report["capacities"][0]["motion"]);
  // Counts from the end of the row, because the kernel's name holds commas.
  CHECK(std::stod(*(points[1].end() - 5)) == Approx(1e6 * first["p50_s"].get<double>()).epsilon(1e-4));
  CHECK(points[1].back() == "20");
}

TEST_CASE("Timing ends as soon as more than a hundredth of all steps was late", "[cli]") {
  cli::CapacitySubject subject({}, 900, "");
  CHECK(cli::time_steps(subject, 500, 100, 0.0).steps == 100);  // every step is late
  CHECK(cli::time_steps(subject, 500, 0, 0.0).steps == 6);
  CHECK(cli::time_steps(subject, 500, 0, 1e3).steps == 500);  // none is
}

TEST_CASE("What fits is what a run of its own confirms, whatever the probes said", "[cli]") {
  const cli::CapacityOptions options;  // options of the command, with a deadline of 1 ms

  // A simulated clock of 1 ns per bristle. Late steps take longer by the factors `probes` and `confirming`.
  const auto clock = [](double probes, double confirming, std::uint64_t late_from = 0, double ns = 1.0) {
    return [=](std::uint64_t bristles, std::uint64_t steps) {
      const double factor = steps <= 300 ? probes : bristles >= late_from ? confirming : 1.0;
      const double seconds = 1e-9 * ns * static_cast<double>(bristles);
      return cli::StepTimes{bristles, steps, seconds, factor * seconds, factor * seconds, factor * seconds};
    };
  };
  const auto told = [&](const cli::CapacityRow& row) {
    cli::CapacityResult result;
    result.rows = {row};
    return std::pair(cli::capacity_table(options, result),
                     json::parse(cli::capacity_json(options, result))["capacities"][0]);
  };

  const cli::CapacityRow usual = cli::find_capacity({}, options, clock(1.0, 1.0));
  CHECK(usual.fits.bristles <= 1'000'000);
  CHECK(usual.fits.bristles >= 980'000);  // the search stops at 2 % precision
  CHECK_FALSE(usual.unconfirmed);

  // Simulates a clock by which 2^24 bristles (the most) fit in every probe of the search, but not in the
  // confirming run, after which the answer is 5 % less.
  const std::uint64_t most = 1u << 24;
  const cli::CapacityRow capped = cli::find_capacity({}, options, clock(1.0, 1.0, most, 1e-3));
  CHECK(capped.capped);
  CHECK(capped.fits.bristles == most);
  const cli::CapacityRow backed_off = cli::find_capacity({}, options, clock(1.0, 1e3, most, 1e-3));
  CHECK_FALSE(backed_off.capped);
  CHECK(backed_off.fits.bristles == static_cast<std::uint64_t>(0.95 * static_cast<double>(most)));
  CHECK(backed_off.fits.p99_s <= options.deadline_s);

  const cli::CapacityRow busy = cli::find_capacity({}, options, clock(1.0, 1e4));
  CHECK(busy.unconfirmed);
  const auto [table, row] = told(busy);
  CHECK_THAT(table, Contains("not confirmed") && !Contains("fewer than 900"));
  CHECK(row["bristles"] == 0);
  CHECK(row["unconfirmed"] == true);

  // Simulates a clock by which one step in a hundred takes three times as long; the median of 1 ns a bristle
  // would allow a million bristles.
  const cli::CapacityRow delayed = cli::find_capacity({}, options, clock(3.0, 3.0));
  CHECK(delayed.fits.bristles < 340'000);
  CHECK_THAT(told(delayed).first,
             Contains("LOWER BOUND, MACHINE BUSY in 1 of 1 rows") && Contains("at least 33"));
  cli::text_layout().columns = 0;  // as with --wide
  CHECK_THAT(told(delayed).first, Contains(" 1,000,000 "));
  cli::text_layout() = cli::TextLayout();
  CHECK_THAT(told(usual).first, StartsWith("1.00 ms of one thread are enough for 1,000,000") &&
                                    !Contains("BUSY") && !Contains("at least"));

  const cli::CapacityRow slow = cli::find_capacity({}, options, clock(1e4, 1e4));
  const auto [slow_table, slow_row] = told(slow);
  CHECK_THAT(slow_table, Contains("fewer than 900"));
  CHECK(slow_row["bristles"] == 0);
  CHECK(slow_row["unconfirmed"] == false);
}

TEST_CASE("stability works with as many threads as the system gives", "[cli]") {
// Sanitizers need too much memory of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

  // Stacks of 256 MB in an address space of 1.5 GB leave room for a few threads. The
  // program may exit with 124 (still at work at the timeout) or 1 (no memory for its arrays), but no signal
  // may end it.
  const int status = std::system("ulimit -v 1500000; ulimit -s 250000; timeout 1 '" BRISTLE_CLI
                                 "' stability --quick --threads 1024 >/dev/null 2>&1");
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) < 128);
#endif
}

TEST_CASE("Discs are compared in sliding, where their torque stays, and there and back, where all sticks",
          "[cli]") {
  for (const auto make : {+[](bool back) { return cli::brush_disc(0.003, back, ""); },
                          +[](bool back) { return cli::lugre_disc(0.003, back); }}) {
    cli::Contestant on = make(false), to_and_fro = make(true);
    const double sliding = on.step();
    for (int i = 0; i < 4; ++i) CHECK(on.step() == Approx(sliding).epsilon(1e-3));
    // A step back unloads by 0.003 of a length at the rim; sliding builds up over half a length or a whole
    // one.
    double before = to_and_fro.step();
    for (int i = 0; i < 3; ++i) {
      const double back = to_and_fro.step();
      CHECK(back / before < 0.998);
      CHECK(back / before > 0.98);
      before = to_and_fro.step();
      CHECK(before / back >= 1.0);
    }
  }
}

TEST_CASE("An experiment writes its curves, its findings and its picture", "[cli]") {
  const Folder folder;
  // Checks that options take precedence over the file, and the file over the defaults, and that the table of
  // another experiment is ignored.
  const std::string config =
      folder.write("drift.toml", "[drift]\nload = 1.2\ncycles = 4\n[load-step]\nload = 7\n");
  const json report = run_report(folder, "experiment drift --models lugre,brush_keep --config '" + config +
                                             "' --set cycles=3 --csv '" + folder.at("drift.csv") + "'");
  CHECK(report["schema"] == "bristle-experiment-1");
  const json& one = report["experiments"][0];
  CHECK(one["parameters"]["load"] == 1.2);
  CHECK(one["parameters"]["cycles"] == 3);
  CHECK(one["parameters"]["law"] == "uniform");
  CHECK(one["findings"].size() == 6);
  const auto rows = csv_rows(read_file(folder.at("drift.csv")));
  CHECK(rows[0] == std::vector<std::string>{"panel", "model", "t[s]", "applied[N]", "friction[N]", "x[m]"});
  CHECK(rows.size() > 2000);

  if (std::system("command -v gnuplot >/dev/null 2>&1") == 0) {
    const Outcome plot =
        run_cli(folder, "experiment drift --models lugre --plot '" + folder.at("drift.svg") + "'");
    INFO(plot.err);
    CHECK(plot.code == 0);
    std::size_t shown = 0;
    for (const json& finding : one["findings"]) shown += finding["model"] == "lugre" && finding["shown"];
    CHECK_THAT(plot.out, StartsWith("drift, what is shown of 3 phenomena: " + std::to_string(shown)));
    // Checks that the plot's file has been written to its end.
    CHECK_THAT(read_file(folder.at("drift.svg")), Contains("<svg") && Contains("</svg>"));
  }
}

TEST_CASE("A bad experiment is refused in one line that says what is allowed", "[cli]") {
  const Folder folder;
  check_refused(folder, "experiment drift --set lode=1", {"'lode'", "load"});
  check_refused(folder, "experiment drift --models lugre,dhal", {"'dhal'", "dahl"});
  check_refused(folder, "experiment drift --models lugre,lugre", {"twice"});
  check_refused(folder, "experiment drift --csv - --json -", {"stdout"});
  check_refused(folder, "experiment drift --csv /nowhere/x.csv", {"/nowhere/x.csv"});
  check_refused(folder, "experiment drift --plot /nowhere/x.png", {"x.png"});
  check_refused(folder, "experiment drift --set dt=0.1", {"dt", "0.1", "at most"});
  check_refused(folder, "experiment all --set load=1", {"EXPERIMENT.KEY=VALUE"});
  check_refused(folder, "experiment drift --config '" + folder.write("a.toml", "load = \"much\"\n") + "'",
                {"a.toml:1", "load", "number"});
  check_refused(folder, "experiment drift --config '" + folder.write("b.toml", "\nlode = 1\n") + "'",
                {"b.toml:2", "'lode'"});
  check_refused(folder, "experiment drift --config '" + folder.write("c.toml", "load = [[[[\n") + "'",
                {"c.toml:1"});
  check_refused(folder, "experiment drift --config '" + folder.write("d.toml", "[dirft]\nload = 1\n") + "'",
                {"d.toml:1", "dirft"});
}

TEST_CASE("A fit writes a scene that replays its data, a report, the curve and a picture", "[cli][fit]") {
  const Folder folder;
  const std::string csv = folder.at("fit.csv"), toml = folder.at("fitted.toml");
  const json report =
      run_report(folder, "fit '" BRISTLE_SCENES "/sled.csv' --csv '" + csv + "' --write '" + toml + "'");
  CHECK(report["schema"] == "bristle-fit-1");
  CHECK(report["data"]["samples"] == 1201);
  CHECK(report["data"]["encoder_step_m"] == Approx(0.5e-6));
  for (const char* key : {"kinetic", "presliding_length", "spread", "viscous_friction", "sensor_offset"}) {
    const json& parameter = report["parameters"][key];
    CHECK(parameter["determined"] == true);
    CHECK(parameter["low"] < parameter["value"]);
    CHECK(parameter["value"] < parameter["high"]);
  }
  CHECK(report["parameters"]["damping_per_newton"]["determined"] == false);
  CHECK_THAT(report["parameters"]["damping_per_newton"]["why"].get<std::string>(), Contains("not seen"));
  const auto rows = csv_rows(read_file(csv));
  REQUIRE(rows.size() == 1 + 1201);
  CHECK(rows[0] == std::vector<std::string>{"t", "x", "load", "force", "fit", "residual"});

  if (std::system("command -v gnuplot > /dev/null") == 0) {
    const std::string png = folder.at("fit.png");
    const std::string beside = folder.write("fit.png.csv", "mine");
    const Outcome drawn = run_cli(folder, "fit '" BRISTLE_SCENES "/sled.csv' --plot '" + png + "'");
    CHECK(drawn.code == 0);
    CHECK_THAT(drawn.out, StartsWith(fmt::format("The brush explains {:.2f} % of the force",
                                                 100.0 * report["residuals"]["explained"].get<double>())) &&
                              Contains(": kinetic 0."));
    CHECK(read_file(png).starts_with("\x89PNG"));
    CHECK(read_file(beside) == "mine");
  }

  // Checks that the page of a fit beside its rivals holds both tables and a picture, and is the only new
  // file.
  if (std::system("command -v gnuplot > /dev/null") == 0) {
    const Folder alone;
    const std::string data = alone.write("a<b.csv", read_file(BRISTLE_SCENES "/sled.csv"));
    const Outcome fit = run_cli(folder, "fit '" + data + "' --rivals --html '" + alone.at("fit.html") + "'");
    INFO(fit.err);
    CHECK(fit.code == 0);
    const std::string page = read_file(alone.at("fit.html"));
    CHECK(page.starts_with("<!doctype html>"));
    CHECK(page.ends_with("</svg>\n\n</html>\n"));
    for (const char* part : {"a&lt;b.csv</title>", "Maxwell-slip", "presliding_length", "<svg"})
      CHECK_THAT(page, Contains(part));
    CHECK_THAT(page, !Contains("a<b") && !Contains("<?xml"));
    CHECK(std::distance(std::filesystem::directory_iterator(alone.path), {}) == 2);
  }

  // Checks that in `bristle run` the fitted material slides with the fitted coefficient: 1800 bristles
  // fluctuate by 1.7 %, the mean over hundreds of snap lengths by a tenth of that. Viscous friction is apart.
  const json replay = run_report(folder, "run '" + toml + "'");
  const json& coefficient = replay["patches"][0]["coefficient"];
  const double kinetic = report["parameters"]["kinetic"]["value"];
  CHECK(coefficient["kinetic_theory"] == Approx(kinetic).epsilon(1e-9));
  CHECK(coefficient["sliding"] == Approx(kinetic).epsilon(0.01));
  CHECK(replay["traces"][0]["rows"] == 1201);
}

TEST_CASE("A fit holds residual, renewal and the damper's decay where they are given", "[cli][fit]") {
  const Folder folder;
  const std::string toml = folder.at("fitted.toml");
  const json report = run_report(folder, "fit '" BRISTLE_SCENES
                                         "/sled.csv' --residual 0.2 --renewal 0.5"
                                         " --decay gaussian --write '" +
                                             toml + "'");
  CHECK_THAT(read_file(toml), Contains("damper_decay = \"gaussian\""));
  const json& residual = report["parameters"]["residual_share"];
  CHECK(residual["value"] == 0.2);
  CHECK(residual["determined"] == false);
  CHECK(residual["why"] == "held");
  CHECK(report["parameters"]["shared_renewal"]["value"] == 0.5);
  CHECK(report["parameters"]["kinetic"]["determined"] == true);
  const std::string sled = "fit '" BRISTLE_SCENES "/sled.csv' ";
  check_refused(folder, sled + "--residual 1", {"--residual", "0.95"});
  check_refused(folder, sled + "--renewal -1", {"--renewal"});
  check_refused(folder, sled + "--rule slide --renewal 1",
                {"--residual and --renewal: other values than 0 need --rule redraw"});
}

TEST_CASE("A fit beside rivals judges all models on the part that none has seen", "[cli][fit]") {
  const Folder folder;
  // Record of 500 rows of a block on a spring with a limit of 0.6 N, Coulomb's friction with presliding.
  std::string csv = "t,x,load,force\n";
  double x = 0.0, z = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double t = 0.02 * i, next = 40e-6 * std::sin(3.0 * t);
    z = std::clamp(z + next - x, -10e-6, 10e-6);
    x = next;
    csv += fmt::format("{},{},2,{}\n", t, x, 6e4 * z + 1e-3 * std::sin(1000.0 * t));
  }
  const std::string file = folder.write("spring.csv", csv);
  const json report = run_report(folder, "fit '" + file + "' --rivals --fit-until 4");
  CHECK(report["schema"] == "bristle-fit-rivals-1");
  CHECK(report["fit_until_s"] == 4.0);
  CHECK(report["samples"]["fitted"] == 201);
  std::vector<std::string> names;
  for (const json& model : report["models"]) {
    names.push_back(model["model"]);
    CHECK(model["judged_rms_n"] > 0.0);
    // Checks that the fit's rival model, a single Maxwell-slip element, fits this record exactly.
    if (model["model"] == "Maxwell-slip") CHECK(model["judged_rms_n"] < 0.02);
  }
  for (const char* name : {"Coulomb", "LuGre", "Maxwell-slip", "brush, the paper's", "brush, slide"})
    CHECK(std::find(names.begin(), names.end(), name) != names.end());
  // Checks that all output files except that of --json come from the fit to the whole record.
  const Outcome table = run_cli(folder, "fit '" + file + "' --rivals --csv '" + folder.at("fit.csv") + "'");
  CHECK(table.code == 0);
  CHECK_THAT(table.out, Contains("Closest to the rest of the record:"));
  // Checks the rivals' forces: a single Maxwell-slip element follows the spring, and Coulomb's friction,
  // which has no presliding, cannot.
  const auto rows = csv_rows(read_file(folder.at("fit.csv")));
  REQUIRE(rows.size() == 501);
  REQUIRE(rows[0] == std::vector<std::string>{"t", "x", "load", "force", "fit", "residual", "Coulomb",
                                              "LuGre", "Maxwell-slip"});
  double coulomb = 0.0, maxwell = 0.0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    coulomb = std::max(coulomb, std::abs(std::stod(rows[i][6]) - std::stod(rows[i][3])));
    maxwell = std::max(maxwell, std::abs(std::stod(rows[i][8]) - std::stod(rows[i][3])));
  }
  CHECK(maxwell < 0.05);
  CHECK(coulomb > 0.3);
  check_refused(folder, "fit '" + file + "' --rivals --fit-until 100", {"nothing is left to judge"});
  check_refused(folder, "fit '" + file + "' --fit-until 4", {"--fit-until: only with --rivals"});
}

TEST_CASE("A fit is refused in one line on bad options and data", "[cli][fit]") {
  const Folder folder;
  const std::string sled = "fit '" BRISTLE_SCENES "/sled.csv' ";
  check_refused(folder, "fit", {"DATA is required"});
  check_refused(folder, "fit nowhere.csv", {"nowhere.csv: cannot be read"});
  check_refused(folder, sled + "--law table", {"--law is 'table'; allowed: lognormal, normal, uniform"});
  check_refused(folder, sled + "--sign no", {"--sign is 'no'; allowed: auto, on, by"});
  check_refused(folder, sled + "--sign on", {"sled.csv: the friction has the wrong sign", "--sign by"});
  check_refused(folder, sled + "--load 0", {"--load"});
  check_refused(folder, sled + "--write /nowhere/a.toml", {"/nowhere/a.toml: cannot be written"});
  check_refused(folder,
                "fit '" + folder.write("few.csv", "t,x,load,force\n0,0,1,1\n1,1,1,1\n2,2,1,1\n") + "'",
                {"3 data rows; a fit needs at least 20"});
}

}  // namespace bristle_test::test_cli
