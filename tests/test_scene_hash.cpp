// Compares the state hash of each scene in tools/scenes with the recorded one, on every instruction set and
// number of threads. A changed hash means changed bits or a changed scene. If that is intended, record it
// again:
// BRISTLE_RECORD_GOLDEN=1 bristle_tests "Each scene*"
#include <catch2/catch.hpp>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "temporary_folder.hpp"
#include "test_paths.hpp"
#include "tools/libraries/files/force_file.hpp"
#include "tools/libraries/run/run.hpp"
#include "tools/libraries/scene/scene.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace bristle_test::test_scene_hash {

namespace {

/// Returns the files of scenes with patches. Scenes of beds have no state hash; test_beds.cpp compares beds.
std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(BRISTLE_SCENES)) {
    if (entry.path().extension() != ".toml") continue;
    std::ifstream file(entry.path());
    const std::string text(std::istreambuf_iterator<char>(file), {});
    if (text.find("[[bed]]") == std::string::npos && text.find("[[joint]]") == std::string::npos)
      names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

cli::Scene read(const std::string& name) {
  return cli::read_scene(std::string(BRISTLE_SCENES) + "/" + name + ".toml");
}

/// Returns the steps of a scene after which its hash is taken: enough for contact, sliding and reversal if
/// they come early, and few if a step takes long.
std::uint64_t steps_of(const cli::Scene& scene) {
  std::uint64_t bristles = 0;
  for (const cli::ScenePatch& patch : scene.patches)
    bristles += std::uint64_t{patch.count} * patch.options.bristles;
  const std::uint64_t affordable = 1500000 / std::max<std::uint64_t>(bristles, 1000);
  return std::clamp<std::uint64_t>(affordable, 8, 1500);
}

std::string hash_of(const cli::Scene& scene, std::uint64_t steps, const char* isa, int threads) {
  cli::RunOptions options;
  options.steps = steps;
  options.isa = isa;
  options.threads = threads;
  char text[20];
  std::snprintf(text, sizeof text, "%016" PRIx64, cli::run_scene(scene, options).state_hash);
  return text;
}

}  // namespace

TEST_CASE("Each scene has its state hash on record, whatever steps it", "[determinism][scenes]") {
  const std::string file = "golden_scene_hash.csv";
  if (std::getenv("BRISTLE_RECORD_GOLDEN")) {
    std::ofstream out(data_folder() + "/" + file);
    out << "scene,steps,state_hash\n";
    for (const std::string& name : scene_names()) {
      const cli::Scene scene = read(name);
      out << name << ',' << steps_of(scene) << ',' << hash_of(scene, steps_of(scene), "scalar", 1) << '\n';
    }
    REQUIRE(out.flush());
    std::printf("recorded tests/data/%s\n", file.c_str());
  }
  const std::vector<Row> record = read_table(file);
  for (const std::string& name : scene_names()) {
    const auto row =
        std::find_if(record.begin(), record.end(), [&](const Row& r) { return r.at("scene") == name; });
    if (row == record.end()) {
      FAIL_CHECK("scene " << name << " has no hash on record: see the top of test_scene_hash.cpp");
      continue;
    }
    const auto steps = static_cast<std::uint64_t>(number(*row, "steps"));
    const cli::Scene scene = read(name);
    for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
      if (!isa.usable) continue;
      INFO(name << ", " << steps << " steps, " << isa.name);
      CHECK(hash_of(scene, steps, isa.name, 1) == row->at("state_hash"));
    }
    for (int threads : {2, 3, 8}) {
      INFO(name << ", " << steps << " steps, " << threads << " threads");
      CHECK(hash_of(scene, steps, "", threads) == row->at("state_hash"));
    }
  }
}

TEST_CASE("A scene may give the spread of snap lengths in place of the peak", "[scenes]") {
  const auto read_law = [](const std::string& keys) {
    return cli::parse_scene(
               "[scene]\nname = \"s\"\ndt = 1e-3\nduration = 1\n[[material]]\nname = \"m\"\n" + keys +
                   "[[patch]]\nname = \"p\"\nmaterial = \"m\"\nmax_normal_load = 1.0\n"
                   "[[motion]]\npatch = \"p\"\ntype = \"ramp\"\nvelocity = [1e-3, 0.0]\nload = 1.0\n",
               "spread.toml")
        .materials.at(0)
        .material;
  };
  CHECK(read_law("kinetic = 0.5\nspread = 0.8\n").snap_length.cv() == 0.8);
  CHECK(read_law("kinetic = 0.5\nspread = 0.8\n").kinetic_coefficient() == Approx(0.5).epsilon(1e-9));
  CHECK(names(message_of<std::exception>([&] { read_law("kinetic = 0.5\npeak = 0.7\nspread = 0.8\n"); }),
              {"leave out peak (0)"}));
}

TEST_CASE("A scene gives ageing and strengthening by coefficients or by bristle parameters, not by both",
          "[scenes][ageing]") {
  const auto scene = [](const std::string& material) {
    return cli::parse_scene(
        "[scene]\nname = \"aged\"\ndt = 1e-3\nduration = 1\n[[material]]\nname = \"m\"\n" + material +
            "[[patch]]\nname = \"p\"\nmaterial = \"m\"\nmax_normal_load = 1.0\n"
            "[[motion]]\npatch = \"p\"\ntype = \"ramp\"\nvelocity = [1e-3, 0.0]\nload = 1.0\n",
        "aged.toml");
  };
  const auto refusal = [&](const std::string& material) {
    return message_of<std::exception>([&] { scene(material); });
  };
  const std::string parameters =
      "ageing_strength = 0.02\nageing_form = \"saturating\"\nageing_time = 7\nspeed_strengthening = 0.01\n"
      "strengthening_speed = 1e-7\n";
  INFO(refusal(parameters));
  const bristle::Material skin = scene(parameters).materials.at(0).material;
  CHECK(skin.ageing_form == bristle::AgeingForm::saturating);
  CHECK(skin.ageing_strength == 0.02);
  CHECK(skin.ageing_time == 7.0);
  CHECK(skin.speed_strengthening == 0.01);
  CHECK(skin.strengthening_speed == 1e-7);
  const std::string coefficients =
      "kinetic = 0.3\npeak = 0.36\nkinetic_speed = 2e-3\nfall_per_decade = 0.03\nageing_time = 1e-4\n";
  INFO(refusal(coefficients));
  const bristle::Material metal = scene(coefficients).materials.at(0).material;
  CHECK(metal.kinetic_coefficient(2e-3) == Approx(0.3).epsilon(1e-9));
  CHECK(metal.coefficients(2e-3).fall_per_decade == Approx(0.03).epsilon(1e-6));
  CHECK(refusal(coefficients + "ageing_strength = 0.1\n").find("mixes coefficients") != std::string::npos);
  CHECK(refusal(coefficients + "growth_per_decade = 0.1\n").find("give one of the two") != std::string::npos);
}

namespace {

/// Makes a scene of a body on a patch with two axes, and with these keys beside its mass and patch.
cli::Scene body_scene(const std::string& body, double duration) {
  return cli::parse_scene("[scene]\nname = \"s\"\ndt = 1e-4\nduration = " + std::to_string(duration) +
                              "\n[[material]]\nname = \"wood\"\nkinetic = 0.4\npeak = 0.46\n"
                              "presliding_length = 2e-5\n"
                              "[[patch]]\nname = \"base\"\nmaterial = \"wood\"\nmax_normal_load = 5.0\n"
                              "[[body]]\nname = \"block\"\nmass = 0.25\ngravity = 10\n"
                              "patches = [\"base\"]\n" +
                              body,
                          "spring.toml");
}

}  // namespace

TEST_CASE("A hand on a spring pulls a body without load as a driven oscillator", "[scenes][spring]") {
  // The lag e of the body behind a hand of speed v obeys m e'' + c e' + k e = 0 with e(0) = 0, e'(0) = v.
  const double m = 0.25, k = 100.0, v = 0.01;
  for (const double c : {0.0, 3.0}) {
    CAPTURE(c);
    const cli::Scene scene =
        body_scene("extra_load = -2.5\nspring = { stiffness = 100, damping = " + std::to_string(c) +
                       ", type = \"ramp\", velocity = [0, 0.01] }\n",
                   0.4);
    const double decay = 0.5 * c / m, w = std::sqrt(k / m - decay * decay);
    int step = 0;
    double worst = 0.0;
    cli::run_scene(scene, {}, [&](const cli::SceneStepper& stepper) {
      const double t = 1e-4 * ++step, lag = v / w * std::exp(-decay * t) * std::sin(w * t);
      worst = std::max(worst, std::fabs(stepper.bodies()[0].position()[1] - (v * t - lag)));
      CHECK(stepper.bodies()[0].position()[0] == 0.0);
    });
    CHECK(step == 4000);
    CHECK(worst < 1e-5 * v / w);
  }
}

TEST_CASE("A stiff spring keeps the energy of a body without load in steps as long as its period",
          "[scenes][spring]") {
  const double m = 0.25, k = 1e8, v = 0.1;  // the period is 3.1 steps
  const cli::Scene scene = body_scene(
      "extra_load = -2.5\nvelocity = [0.1, 0]\nspring = { stiffness = 1e8, type = \"hold\" }\n", 0.1);
  double furthest = 0.0;
  cli::run_scene(scene, {}, [&](const cli::SceneStepper& stepper) {
    const double x = stepper.bodies()[0].position()[0], u = stepper.bodies()[0].velocity()[0];
    REQUIRE(0.5 * (m * u * u + k * x * x) == Approx(0.5 * m * v * v).epsilon(1e-9));
    furthest = std::max(furthest, x);
  });
  CHECK(furthest == Approx(v * std::sqrt(m / k)).epsilon(0.01));
}

TEST_CASE("A hand on a spring breaks a body away at its peak and drags it by kinetic friction over stiffness",
          "[scenes][spring]") {
  const cli::Scene scene = body_scene(
      "force = [ { t = 0, x = 0.25 } ]\n"
      "spring = { stiffness = 2000, damping = 5, type = \"keyframes\", keyframes = [ { t = 0, x = 0 }, "
      "{ t = 1.5, x = 3e-3 }, { t = 2, x = 3e-3 } ] }\n",
      2.0);
  int step = 0;
  double lag = 0.0;
  const cli::RunResult result = cli::run_scene(scene, {}, [&](const cli::SceneStepper& stepper) {
    const double t = 1e-4 * ++step;
    if (t > 1.4 && t <= 1.5) lag += (2e-3 * t - stepper.bodies()[0].position()[0]) / 1000;
  });
  CHECK(lag == Approx((0.4 * 2.5 - 0.25) / 2000).epsilon(1e-3));
  const cli::Sticking& sticking = result.bodies[0].sticking;
  CHECK(sticking.broke_away);
  CHECK(sticking.applied == Approx(0.46 * 2.5).epsilon(0.03));  // N, with the spring
  CHECK(sticking.time ==
        Approx(((0.46 * 2.5 - 0.25) / 2000 + 20e-6) / 2e-3).epsilon(0.02));  // s, of the hand
  CHECK(3e-3 - result.bodies[0].position[0] > 0.2 * 0.75 / 2000);            // m, held when the hand stops
}

TEST_CASE("A spring that a scene cannot have is refused with its place", "[scenes][spring]") {
  const auto refusal = [](const std::string& keys) {
    return message_of<std::exception>([&] { body_scene("spring = { " + keys + " }\n", 1.0); });
  };
  CHECK(names(refusal("stiffness = 10, type = \"hold\", load = 1"), {"unknown key 'load'", "stiffness"}));
  CHECK(names(refusal("stiffness = 10"), {"spring", "key 'type' is missing"}));
  CHECK(names(refusal("stiffness = 10, type = \"trace\""), {"'trace'", "keyframes"}));
  CHECK(names(refusal("stiffness = 0, type = \"hold\""), {"stiffness", "N/m"}));
  CHECK(names(refusal("stiffness = 10, damping = -1, type = \"hold\""), {"damping", "N s/m"}));
  cli::Scene scene = body_scene("spring = { stiffness = 10, type = \"ramp\", velocity = 1 }\n", 1.0);
  CHECK(scene.bodies[0].spring->stiffness == 10.0);
  CHECK(scene.bodies[0].spring->damping == 0.0);
}

TEST_CASE("A force file counts the bristles of representatives, and none of an infinite brush", "[scenes]") {
  const cli::Scene scene = cli::parse_scene(
      "[scene]\nname = \"s\"\ndt = 1e-3\nduration = 0.001\n"
      "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n"
      "[[patch]]\nname = \"some\"\nmaterial = \"wood\"\nmax_normal_load = 2.0\nbristles = 50\n"
      "[[motion]]\npatch = \"some\"\ntype = \"hold\"\nload = 1\n"
      "[[patch]]\nname = \"all\"\nmaterial = \"wood\"\nmax_normal_load = 2.0\n"
      "[[motion]]\npatch = \"all\"\ntype = \"hold\"\nload = 1\n",
      "s.toml");
  const TemporaryFolder folder;
  cli::RunOptions options;
  options.out = folder.at("forces.csv");
  cli::run_scene(scene, options);
  std::ifstream rows(options.out);
  std::string head, some, all;
  std::getline(rows, head);
  std::getline(rows, some);
  std::getline(rows, all);
  CHECK(head.rfind("t,patch,fx,fy,load,bristles,status", 0) == 0);
  CHECK(some.rfind("0.001,some,0,0,1,25,ok", 0) == 0);
  CHECK(all.rfind("0.001,all,0,0,1,,ok", 0) == 0);
}

TEST_CASE("Delayed copies and slanted lines of one axis move as their scene says, and each row has all cells",
          "[scenes]") {
  cli::Scene scene = cli::parse_scene(
      "[scene]\nname = \"s\"\ndt = 1e-3\nduration = 0.1\n"
      "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n"
      "[[patch]]\nname = \"pair\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 50\ncount = 2\n"
      "[[motion]]\npatch = \"pair\"\ntype = \"keyframes\"\ndelay_per_copy = 0.04\n"
      "keyframes = [{ t = 0.0, load = 0.0 }, { t = 0.1, load = 1.0 }]\n"
      "[[patch]]\nname = \"line\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 50\naxes = 2\n"
      "outputs = [\"energy\"]\n"
      "[[motion]]\npatch = \"line\"\ntype = \"ramp\"\nvelocity = [0.03, 0.04]\nload = 1.0\n",
      "s.toml");
  scene.patches[1].options.axes = 1;  // one axis, as `bristle accuracy` tries for a motion on a line
  const TemporaryFolder folder;
  cli::RunOptions options;
  options.out = folder.at("forces.csv");
  int step = 0;
  cli::run_scene(scene, options, [&](const cli::SceneStepper& stepper) {
    ++step;
    CHECK(stepper.motions()[0].normal_load == Approx(0.01 * step));
    CHECK(stepper.motions()[1].normal_load == Approx(0.01 * std::max(step - 40, 0)));
    CHECK(stepper.motions()[2].displacement[0] == Approx(0.05e-3));
  });
  CHECK(step == 100);
  std::ifstream rows(options.out);
  std::string head;
  std::getline(rows, head);
  for (std::string row; std::getline(rows, row); ++step)
    CHECK(std::count(row.begin(), row.end(), ',') == std::count(head.begin(), head.end(), ','));
  CHECK(step == 400);
  cli::set_rate(scene, 4000.0);
  CHECK(scene.deadline == 1.0 / 4000.0);
  CHECK(cli::status_text(bristle::Status::bad_input | bristle::Status::overload) == "bad_input+overload");
}

}  // namespace bristle_test::test_scene_hash
