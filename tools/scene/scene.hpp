// Scene, read from TOML: materials, contact patches, bodies and motions. Keys: tools/scenes/README.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

#include "tools/files/output_file.hpp"
#include "tools/scene/prescribed_motion.hpp"

namespace cli {

struct SceneMaterial {
  std::string name;
  bristle::Material material;
  std::optional<bristle::Coefficients> coefficients;  ///< friction coefficients, if the scene gives the
                                                      ///< material by them
  std::string where;                                  ///< "file:line: [[material]] 'name'", place of the
                                                      ///< material for messages
};

/// Contact patch of a scene. Either a prescribed motion or a body moves it, never both.
struct ScenePatch {
  std::string name;
  std::size_t material = 0;  ///< index into Scene::materials
  bristle::PatchOptions options;
  std::uint32_t count = 1;            ///< number of copies; copy i has seed + i and the name "name.i"
  int priority = 0;                   ///< under a time budget, patches of lowest priority lose bristles first
  std::uint32_t least_bristles = 64;  ///< number of bristles that a patch keeps under a time budget
  std::uint32_t stride = 1;  ///< if above 1, copy k here is copy k * stride of the scene (others left out)
  std::string where;         ///< "file:line: [[patch]] 'name'", place of the patch for messages
  std::optional<PrescribedMotion> motion;

  /// Returns whether a body moves the patch.
  bool is_carried() const noexcept { return !motion.has_value(); }
};

struct ForceRow {
  double t = 0.0;            ///< s
  double force[2] = {0, 0};  ///< N
};

struct ForceSine {
  double amplitude[2] = {0.0, 0.0};  ///< N
  double frequency = 1.0;            ///< Hz
  double phase = 0.0;                ///< turns
  double from = 0.0, until = 0.0;    ///< s
};

/// Rigid body that slides on patches without turning, under a force that the scene gives over time.
struct SceneBody {
  std::string name;
  double mass = 1.0;                 ///< kg
  double gravity = 9.80665;          ///< m/s^2
  std::vector<LoadStep> extra_load;  ///< N, load in addition to the body's weight
  double velocity[2] = {0.0, 0.0};   ///< m/s, initial velocity
  std::vector<ForceRow> force;       ///< N, pushing force over time; linear between rows, two rows at one
                                     ///< time make a jump
  std::vector<ForceSine> force_sines;
  std::vector<std::size_t> patches;  ///< patches under the body, as indices into Scene::patches
  int axes = 2;

  /// Computes the force (N) that pushes the body at time t.
  void applied_force(double t, double (&force_n)[2]) const noexcept;
};

/// Limits on the memory and size of a scene.
struct SceneLimits {
  /// Bytes of memory that the scene may take, with any number of bristles, patches and materials. If unset:
  /// at most 2^28 bristles in 10^6 patches of 1000 materials, within the free memory.
  std::optional<std::uint64_t> bytes;
};

/// Function called now and then with the share of the work done, 0 to 1.
using ShareDone = std::function<void(double)>;

struct Scene {
  std::string file;
  std::string name;
  std::string description;
  double dt = 1e-3;                ///< s
  std::optional<double> duration;  ///< s, simulated time of the scene; none: length of the longest motion
                                   ///< file
  double deadline = 1e-3;          ///< s
  std::optional<double> budget;    ///< s per step, time budget within which steps stay by leaving out
                                   ///< bristles
  int threads = 1;
  std::uint32_t out_patches = 8;  ///< number of patches whose forces are written
  SceneLimits limits;
  std::vector<std::string> traces;  ///< paths of the motion files that the scene names
  std::vector<SceneMaterial> materials;
  std::vector<ScenePatch> patches;
  std::vector<SceneBody> bodies;

  std::size_t patch_count() const noexcept;  ///< returns the number of patches, all copies included
  double trace_length() const noexcept;      ///< s, length of the longest motion file; 0 without one
};

/// Reads a scene. Throws UserError with file, line and key.
Scene read_scene(const std::string& path, const SceneLimits& limits = {}, const ShareDone& progress = {});
Scene parse_scene(const std::string& text, const std::string& path, const SceneLimits& limits = {},
                  const ShareDone& progress = {});

/// Replaces the motion files of a scene (or all prescribed motions, if it has none) by another motion file,
/// which then gives the duration. `clip_load_n`: as in read_motion_file(). Throws UserError.
void replace_motion(Scene& scene, const std::string& motion_path, double clip_load_n = 0.0);

/// Lists the files that the scene was read from. A command that steps the scene must not overwrite them.
std::vector<FileOption> inputs_of(const Scene& scene);

/// Gives every patch this number of representative bristles. Throws UserError if they are too many in all.
void set_bristles(Scene& scene, std::uint32_t bristles);

}  // namespace cli
