// `bristle run --save-state` and `--restore-state`: a run in two parts gives the results of one.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>

#include "expect.hpp"
#include "temporary_folder.hpp"
#include "test_paths.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/run/run.hpp"

namespace bristle_test::test_run_state {

using Catch::Matchers::Contains;

namespace {

std::string without_header(const std::string& csv) { return csv.substr(csv.find('\n') + 1); }

cli::RunOptions options_of(std::optional<std::uint64_t> steps, const std::string& out = "",
                           const std::string& restore = "", const std::string& save = "") {
  cli::RunOptions options;
  options.steps = steps;
  options.out = out;
  options.restore_state = restore;
  options.save_state = save;
  return options;
}

const std::string small_scene =
    "[scene]\nname = \"small\"\ndt = 1e-3\nduration = 0.02\n"
    "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n"
    "[[patch]]\nname = \"tip\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 50\n"
    "[[motion]]\npatch = \"tip\"\ntype = \"sine\"\namplitude = 3e-5\nfrequency = 70\nload = 0.8\n";

}  // namespace

TEST_CASE("A run saved and taken up again is the run in one piece, bit for bit", "[cli][state]") {
  const TemporaryFolder folder;
  for (const char* name : {"block_on_floor", "two_surfaces", "fingertip", "many_contacts"}) {
    INFO(name);
    const cli::Scene scene = cli::read_scene(std::string(BRISTLE_SCENES "/") + name + ".toml");
    const std::uint64_t n = scene.patch_count() > 100 ? 5 : 150;
    const cli::RunResult whole = cli::run_scene(scene, options_of(2 * n, folder.at("whole.csv")));
    cli::run_scene(scene, options_of(n, folder.at("first.csv"), "", folder.at("state")));
    const cli::RunResult rest =
        cli::run_scene(scene, options_of(n, folder.at("second.csv"), folder.at("state")));
    CHECK(rest.steps_before == n);
    CHECK(rest.state_hash == whole.state_hash);
    REQUIRE(rest.bodies.size() == whole.bodies.size());
    for (std::size_t b = 0; b < whole.bodies.size(); ++b) {
      for (int axis = 0; axis < 2; ++axis) {
        CHECK(rest.bodies[b].position[axis] == whole.bodies[b].position[axis]);
        CHECK(rest.bodies[b].velocity[axis] == whole.bodies[b].velocity[axis]);
      }
    }
    // Checks that the force files of a run's two parts join to that of the whole run, in every digit.
    CHECK(read_file(folder.at("first.csv")) + without_header(read_file(folder.at("second.csv"))) ==
          read_file(folder.at("whole.csv")));
  }
}

TEST_CASE("A run taken up again lasts to the end of its scene, on any number of threads", "[cli][state]") {
  const TemporaryFolder folder;
  const cli::Scene scene = cli::parse_scene(small_scene, "small.toml");
  const cli::RunResult whole = cli::run_scene(scene, options_of({}));
  cli::run_scene(scene, options_of(7, "", "", folder.at("state")));
  cli::RunOptions options = options_of({}, "", folder.at("state"), folder.at("state"));
  options.threads = 2;
  options.isa = "scalar";
  const cli::RunResult rest = cli::run_scene(scene, options);
  CHECK(rest.steps_before == 7);
  CHECK(rest.steps == 13);
  CHECK(rest.state_hash == whole.state_hash);
  CHECK_THAT(message_of<cli::UserError>([&] { cli::run_scene(scene, options); }),
             Contains("20 steps") && Contains("--steps"));
}

TEST_CASE("Friction of strokes along y is counted from each turn, through a saved state as in one run",
          "[cli][state]") {
  const TemporaryFolder folder;
  const auto scene_of = [](double load) {
    return cli::parse_scene(
        "[scene]\nname = \"strokes\"\ndt = 1e-3\nduration = 1\n"
        "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n"
        "[[patch]]\nname = \"tip\"\nmaterial = \"wood\"\nmax_normal_load = 1\nbristles = 50\naxes = 2\n"
        "outputs = [\"mean\", \"energy\"]\n"
        "[[motion]]\npatch = \"tip\"\ntype = \"sine\"\namplitude = [0, 3e-4]\nfrequency = 1\nload = " +
            std::to_string(load) + "\n",
        "strokes.toml");
  };
  const cli::Scene scene = scene_of(0.8);
  // Expects sliding from ten mean lengths after a turn; turns are at a quarter and at three quarters.
  const double far = 10.0 * scene.materials[0].material.snap_length.mean();
  std::uint64_t sliding = 0;
  for (int k = 1; k <= 1000; ++k) {
    const double y = 3e-4 * std::sin(2e-3 * M_PI * k);
    sliding += std::abs(y - (k <= 250 ? 0.0 : k <= 750 ? 3e-4 : -3e-4)) > far ? 1 : 0;
  }
  const cli::PatchResult whole = cli::run_scene(scene, options_of({})).patches[0];
  CHECK(whole.sliding_steps == sliding);
  CHECK(whole.work == Approx(whole.dissipated + whole.stored).epsilon(1e-6));
  const cli::PatchResult first =
      cli::run_scene(scene, options_of(500, "", "", folder.at("state"))).patches[0];
  const cli::PatchResult rest = cli::run_scene(scene, options_of({}, "", folder.at("state"))).patches[0];
  CHECK(first.sliding_steps + rest.sliding_steps == sliding);
  CHECK(whole.highest_coefficient > 0.0);
  CHECK(cli::run_scene(scene_of(0.05), options_of({})).patches[0].highest_coefficient == 0.0);  // a twentieth
}

TEST_CASE("A paced run, which has the next motion ready when it stops, is taken up with the same bits",
          "[cli][state]") {
  const TemporaryFolder folder;
  const cli::Scene scene = cli::parse_scene(small_scene, "small.toml");
  const cli::RunResult whole = cli::run_scene(scene, options_of(20, folder.at("whole.csv")));
  cli::RunOptions paced = options_of(9, folder.at("first.csv"), "", folder.at("state"));
  paced.realtime = cli::RealtimeOptions{};
  cli::run_scene(scene, paced);
  const cli::RunResult rest =
      cli::run_scene(scene, options_of(11, folder.at("second.csv"), folder.at("state")));
  CHECK(rest.state_hash == whole.state_hash);
  CHECK(read_file(folder.at("first.csv")) + without_header(read_file(folder.at("second.csv"))) ==
        read_file(folder.at("whole.csv")));
}

TEST_CASE("A saved run is refused by a scene that it is not of", "[cli][state]") {
  const TemporaryFolder folder;
  const cli::Scene scene = cli::parse_scene(small_scene, "small.toml");
  cli::run_scene(scene, options_of(3, "", "", folder.at("state")));
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& file) {
    std::string text = small_scene;
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    const cli::Scene other = cli::parse_scene(text, "other.toml");
    const std::string why =
        message_of<cli::UserError>([&] { cli::run_scene(other, options_of(3, "", file)); });
    CHECK_THAT(why, Contains(file));
    return why;
  };
  CHECK_THAT(refused("dt = 1e-3", "dt = 2e-3", folder.at("state")),
             Contains("0.001 s") && Contains("0.002 s"));
  CHECK_THAT(refused("bristles = 50", "bristles = 50\ncount = 2", folder.at("state")),
             Contains("1 patches") && Contains("2 and 0"));
  CHECK_THAT(refused("bristles = 50", "bristles = 50\nseed = 2", folder.at("state")),
             Contains("other options"));
  CHECK_THAT(refused("bristles = 50", "bristles = 40", folder.at("state")), Contains("other options"));
  CHECK_THAT(refused("", "", folder.at("nothing")), Contains("No such file"));

  const std::string whole = read_file(folder.at("state"));
  CHECK_THAT(refused("", "", folder.write("foreign", "t,x,y\n")), Contains("is no state of a run"));
  const std::string line = "bristle run 1\n";
  const std::size_t head = line.size() + 8 * (4 + 4);  // one patch, no body
  for (std::size_t size = line.size(); size < whole.size(); size += 7)
    CHECK_THAT(refused("", "", folder.write("cut", whole.substr(0, size))), Contains("cut short"));
  for (const auto& [offset, byte] : {std::pair{line.size() + 7, '\377'}, std::pair{head - 1, '\177'}}) {
    std::string damaged = whole;
    damaged[offset] = byte;
    damaged[offset - 1] = '\360';
    CHECK_THAT(refused("", "", folder.write("damaged", damaged)), Contains("not a finite number in range"));
  }
}

TEST_CASE("A place where no state can be saved is refused before the run", "[cli][state]") {
  const TemporaryFolder folder;
  const cli::Scene scene = cli::parse_scene(small_scene, "small.toml");
  const std::string file = folder.write("file", "");
  const auto refused = [&](const std::string& target) {
    // Checks that the refusal comes before the run begins, so that it leaves no force file.
    const std::string why =
        message_of<cli::UserError>([&] { cli::run_scene(scene, options_of(3, folder.at("f"), "", target)); });
    CHECK_THAT(why, Contains(target));
    CHECK_FALSE(std::filesystem::exists(folder.at("f")));
    return why;
  };
  CHECK_THAT(refused(folder.path.string()), Contains("cannot be written: Is a directory"));
  CHECK_THAT(refused(folder.at("none/state")), Contains("cannot be written: No such file"));
  CHECK_THAT(refused(folder.at("none/")), Contains("cannot be written: No such file"));
  CHECK_THAT(refused(file + "/state"), Contains("cannot be written: Not a directory"));
#if defined(__unix__)
  CHECK_THAT(refused(folder.at(std::string(300, 'a'))), Contains("cannot be written: File name too long"));
#endif
}

}  // namespace bristle_test::test_run_state
