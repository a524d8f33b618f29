// Huge scenes: the memory they need is stated before it is allocated, a limit can be raised, and a user at a
// terminal sees progress.
#include <catch2/catch.hpp>

#include <cstdlib>
#include <string>

#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "temporary_folder.hpp"
#include "test_paths.hpp"
#include "tools/libraries/scene/scene_memory.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace bristle_test::test_scene_memory {

using Catch::Matchers::Contains;

namespace {

std::string material(const std::string& name, const std::string& keys) {
  return "[[material]]\nname = \"" + name + "\"\n" + keys + "\n";
}

std::string patch(const std::string& name, const std::string& keys) {
  return "[[patch]]\nname = \"" + name + "\"\nmax_normal_load = 2.0\n" + keys + "\n[[motion]]\npatch = \"" +
         name + "\"\ntype = \"hold\"\nload = 1.0\n";
}

const std::string head = "[scene]\nname = \"large\"\ndt = 1e-3\nduration = 0.001\n";
const std::string wood = material("wood", "presliding_length = 1e-5");

struct Said {
  int code = -1;
  std::string text;
};

/// Runs a command at a terminal (a pseudo-terminal) and returns its output.
Said at_terminal(const std::string& command) {
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  REQUIRE(child >= 0);
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  Said said;
  char block[4096];
  for (ssize_t got; (got = ::read(terminal, block, sizeof block)) > 0;)
    said.text.append(block, static_cast<std::size_t>(got));
  int status = 0;
  ::waitpid(child, &status, 0);
  ::close(terminal);
  said.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return said;
}

}  // namespace

TEST_CASE("A scene's memory is told before it is taken, within five per cent", "[cli][memory]") {
  const struct {
    const char *material, *patch;
  } cases[] = {
      {"presliding_length = 1e-5", "bristles = 100000"},
      {"presliding_length = 1e-5", "bristles = 100000\naxes = 1"},
      {"presliding_length = 1e-5", "bristles = 100000\nprecision = \"double\""},
      {"presliding_length = 1e-5\nrule = \"keep\"\nshared_renewal = 0", "bristles = 30000\ncount = 3"},
      {"presliding_length = 1e-5\nfall_per_decade = 0.01\nkinetic_speed = 1e-3", "bristles = 100000"},
      {"presliding_length = 1e-5", "count = 70"},
      {"presliding_length = 1e-5", "bristles = 257\ncount = 500"},
      {"presliding_length = 1e-5", "bristles = 64\ncount = 900"},
      {"presliding_length = 1e-5", "population = \"infinite\"\ncount = 300"},
      {"presliding_length = 1e-5", "population = \"infinite\"\nresolution = 20\ncount = 40"}};
  for (const auto& c : cases) {
    CAPTURE(c.material, c.patch);
    const cli::Scene scene = cli::parse_scene(
        head + material("m", c.material) + patch("p", std::string("material = \"m\"\n") + c.patch), "s");
    const cli::SceneStepper stepper(scene, bristle::BatchOptions{});
    double taken = 0.0;
    for (const bristle::Motion& motion : stepper.motions())
      taken += static_cast<double>(stepper.batch().info(motion.id).memory_bytes);
    // estimate_memory() adds some 2 kB for each patch to the bytes that the library itself counts.
    const auto copies = static_cast<double>(stepper.motions().size());
    CHECK(static_cast<double>(cli::estimate_memory(scene)) == Approx(taken + 1900.0 * copies).epsilon(0.05));
  }
}

TEST_CASE("A scene beyond the memory that it may take is refused with what it needs", "[cli][memory]") {
  const TemporaryFolder folder;
  // Scene of 32 million bristles of 20 bytes each, which need 640 MB.
  const std::string file =
      folder.write("large.toml", head + wood + patch("tip", "material = \"wood\"\nbristles = 32000000"));
  Said said = at_terminal("'" BRISTLE_CLI "' run '" + file + "' --memory 100M");
  CHECK(said.code == 2);
  CHECK_THAT(said.text, Contains("need about 6") && Contains("100 MiB are allowed (--memory)"));
  for (const char* wrong : {"much", "12K", "-1G", "nan", "1e300G"}) {
    said = at_terminal(std::string("'" BRISTLE_CLI "' run '") + file + "' --memory=" + wrong);
    CHECK(said.code == 2);
    CHECK_THAT(said.text, Contains("allowed: 1M to 900T"));
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // sanitizers need more than this limit
  said = at_terminal("ulimit -v 300000; '" BRISTLE_CLI "' run '" + file + "'");
  CHECK(said.code == 2);
  CHECK_THAT(said.text, Contains("MiB are free; give fewer bristles, or --memory 6"));
#endif
}

TEST_CASE("A limit given by hand lifts the limits of numbers", "[cli][memory]") {
  std::string text = head + patch("tip", "material = \"m7\"\nbristles = 300000000");
  CHECK_THROWS_WITH(cli::parse_scene(text + material("m7", "presliding_length = 1e-5"), "s"),
                    Contains("bristles"));
  text = head + patch("tip", "material = \"m7\"\ncount = 2000000\nbristles = 1");
  for (int i = 0; i < 1001; ++i)  // all materials have one law, so that set-up is fast
    text += material("m" + std::to_string(i), "bristle_stiffness = 80.0");
  CHECK_THROWS_WITH(cli::parse_scene(text, "s"), Contains("1000 in a scene, or any number with --memory"));
  const cli::Scene scene = cli::parse_scene(text, "s", {std::uint64_t{1} << 30});
  CHECK(scene.materials.size() == 1001);
  CHECK(scene.patch_count() == 2'000'000);
  CHECK_THROWS_WITH(cli::check_memory(scene), Contains("need about") && Contains("1.0 GiB are allowed"));
  CHECK_NOTHROW(cli::check_memory(cli::parse_scene(text, "s", {std::uint64_t{1} << 33})));
}

TEST_CASE("A scene that takes long to read or to step shows how far it is", "[cli][memory]") {
  const TemporaryFolder folder;
  std::string text = head + patch("tip", "material = \"m1\"\nbristles = 100");
  for (int i = 0; i < 700; ++i)
    text += material("m" + std::to_string(i), "presliding_length = " + std::to_string(10 + i) + "e-7");
  Said said = at_terminal("'" BRISTLE_CLI "' run '" + folder.write("many.toml", text) + "'");
  CHECK(said.code == 0);
  CHECK_THAT(said.text, Contains("reading: ") && Contains(" % "));
  said = at_terminal(
      "'" BRISTLE_CLI "' run '" +
      folder.write("large.toml", head + wood + patch("tip", "material = \"wood\"\nbristles = 8000000")) +
      "'");
  CHECK(said.code == 0);
  CHECK_THAT(said.text, Contains("run:   0 % "));
}

}  // namespace bristle_test::test_scene_memory
