#include <string>

#include "check.hpp"
#include "targets.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/scene/scene.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace fuzz {
namespace {

bool is_small(const cli::Scene& scene) {
  std::uint64_t bristles = 0;
  for (const cli::ScenePatch& patch : scene.patches)
    bristles += (patch.options.bristles ? patch.options.bristles : 4096) * std::uint64_t{patch.count};
  return bristles <= 8192 && scene.patch_count() <= 16;
}

void step_some(const cli::Scene& scene) {
  cli::SceneStepper stepper(scene, bristle::BatchOptions{});
  for (int k = 0; k < 3; ++k) {
    const double t = k * scene.dt;
    stepper.prescribe(t);
    stepper.step(t);
    for (const bristle::Response& response : stepper.responses())
      check(!has(response.status, bristle::Status::unknown_id | bristle::Status::repeated_id),
            "a scene steps patches of its own, each once");
  }
}

}  // namespace

void scene(Bytes bytes) {
  const std::string text(bytes.begin(), bytes.end());
  // Skips scenes that contain a motion of type trace, because such a motion reads any file that it names.
  if (text.find("trace") != std::string::npos) return;
  try {
    const cli::Scene scene = cli::parse_scene(text, "scene.toml");
    check(!scene.patches.empty() && scene.dt > 0.0, "a scene that was read has patches and a step");
    if (is_small(scene)) step_some(scene);
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

}  // namespace fuzz
