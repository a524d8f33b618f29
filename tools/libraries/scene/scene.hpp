// A scene as read from a TOML file: materials, contact patches, bodies, motions. tools/scenes/README.md lists
// the keys.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/scene/prescribed_motion.hpp"

namespace cli {

struct SceneMaterial {
  std::string name;
  bristle::Material material;
  /// Friction coefficients of the material, if the scene gives these and not bristle parameters.
  std::optional<bristle::Coefficients> coefficients;
  std::string where;  ///< position of the table, for messages, as "file:line: [[material]] 'name'"
};

/// Contact patch of a scene. It is moved either by a prescribed motion or by a body.
struct ScenePatch {
  std::string name;
  std::size_t material = 0;  ///< index of its material in Scene::materials
  bristle::PatchOptions options;
  std::uint32_t count = 1;   ///< number of copies; copy i has the seed `seed + i`, the name "name.i"
  std::uint32_t stride = 1;  ///< after leaving out copies, copy k is copy k * stride of the file
  std::string where;         ///< position of the table, for messages: "file:line: [[patch]] 'name'"
  std::optional<PrescribedMotion> motion;

  /// Returns whether a body, and not a prescribed motion, moves the patch.
  bool is_carried() const noexcept { return !motion.has_value(); }
};

struct ForceRow {
  double t = 0.0;            ///< time of the row, s
  double force[2] = {0, 0};  ///< pushing force, N
};

struct ForceSine {
  double amplitude[2] = {0.0, 0.0};  ///< amplitude of the force, N
  double frequency = 1.0;            ///< frequency of the sine, Hz
  double phase = 0.0;                ///< phase at `from`, in turns
  double from = 0.0, until = 0.0;    ///< beginning and end, s
};

/// Spring (and damper) between a body and a point whose motion is prescribed, such as a hand that pulls.
struct SceneSpring {
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< N s/m
  PrescribedMotion hand;   ///< motion of the other end; both ends begin at 0
};

/// Rigid body that slides on patches without turning, pushed by a force that the scene prescribes.
struct SceneBody {
  std::string name;
  double mass = 1.0;                 ///< mass of the body, kg
  double gravity = 9.80665;          ///< gravity on the body, m/s^2
  std::vector<LoadStep> extra_load;  ///< normal load beside the body's weight, N
  double velocity[2] = {0.0, 0.0};   ///< initial velocity, m/s
  /// Pushing force over time, N: linear between rows; two rows at one time make a jump.
  std::vector<ForceRow> force;
  std::vector<ForceSine> force_sines;
  std::optional<SceneSpring> spring;
  std::vector<std::size_t> patches;  ///< patches under the body, as indices into Scene::patches
  int axes = 2;

  /// Computes the prescribed force (N) that pushes the body at time t, without that of its spring.
  void applied_force(double t, double (&force_n)[2]) const noexcept;
};

/// Limits on the size of a scene and the memory that it may take.
struct SceneLimits {
  /// Bytes of memory that a scene may take. If set, bristles, patches and materials are not limited besides;
  /// if not, there may be 2^28 bristles, 10^6 patches and 1000 materials, within the free memory.
  std::optional<std::uint64_t> bytes;
};

/// Function called now and then with the share of the work done, 0 to 1, to show progress.
using ShareDone = std::function<void(double)>;

struct Scene {
  std::string file;
  std::string name;
  std::string description;
  double dt = 1e-3;  ///< time step, s
  /// Simulated time, s; if not given, that of the longest motion file.
  std::optional<double> duration;
  double deadline = 1e-3;  ///< time that a step may take, s
  int threads = 1;
  std::uint32_t out_patches = 8;  ///< number of patches in the force file
  SceneLimits limits;
  std::vector<std::string> traces;  ///< paths of motion files named by the scene
  std::vector<SceneMaterial> materials;
  std::vector<ScenePatch> patches;
  std::vector<SceneBody> bodies;

  std::size_t patch_count() const noexcept;  ///< returns the number of patches, with copies
  double trace_length() const noexcept;      ///< duration of the longest motion file, s; 0 without one
};

/// Reads a scene file. Throws UserError with file, line and key.
Scene read_scene(const std::string& path, const SceneLimits& limits = {}, const ShareDone& progress = {});
Scene parse_scene(const std::string& text, const std::string& path, const SceneLimits& limits = {},
                  const ShareDone& progress = {});

/// Replaces the motion files of a scene (or all prescribed motions, if it has no files) by one other file,
/// whose length becomes the duration. Loads from -clip_load_n to 0 count as 0. Throws UserError.
void replace_motion(Scene& scene, const std::string& motion_path, double clip_load_n = 0.0);

/// Lists the files from which the scene was read, which a command must not overwrite.
std::vector<FileOption> inputs_of(const Scene& scene);

/// Gives every patch this number of representative bristles. Throws UserError if they are too many in all.
void set_bristles(Scene& scene, std::uint32_t bristles);

}  // namespace cli
