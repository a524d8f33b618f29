// A scene: materials, contact patches, and what moves them. Read from TOML; keys: tools/scenes/README.md.
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
  std::optional<bristle::Coefficients> coefficients;  ///< where the scene gives these
  std::string where;                                  ///< "file:line: [[material]] 'name'", for messages
};

/// Prescribed motion, a body, or both never: one of the two moves a patch.
struct ScenePatch {
  std::string name;
  std::size_t material = 0;  ///< index into Scene::materials
  bristle::PatchOptions options;
  std::uint32_t count = 1;            ///< copies; copy i has seed + i and the name "name.i"
  int priority = 0;                   ///< under a budget: the lowest gives bristles first
  std::uint32_t least_bristles = 64;  ///< and keeps at least this many
  std::uint32_t stride = 1;  ///< only every `stride`-th copy: the k-th of `count` is then copy k stride
  std::string where;         ///< "file:line: [[patch]] 'name'", for messages
  std::optional<PrescribedMotion> motion;

  bool is_carried() const noexcept { return !motion.has_value(); }  ///< by a body
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

/// A rigid body that slides on patches without turning, pushed by a force known beforehand.
struct SceneBody {
  std::string name;
  double mass = 1.0;                 ///< kg
  double gravity = 9.80665;          ///< m/s^2
  std::vector<LoadStep> extra_load;  ///< N beside the weight
  double velocity[2] = {0.0, 0.0};   ///< m/s at the start
  std::vector<ForceRow> force;       ///< linear between rows; rows at one time make a jump
  std::vector<ForceSine> force_sines;
  std::vector<std::size_t> patches;  ///< indices into Scene::patches
  int axes = 2;

  /// Applied force at time t, N.
  void applied_force(double t, double (&force_n)[2]) const noexcept;
};

/// Limits of what a scene may take of the machine.
struct SceneLimits {
  /// Of memory. Where it is given, a scene may hold as many bristles, patches and materials as go into it;
  /// else at most 2^28 in 10^6 patches of 1000 materials, in what is free.
  std::optional<std::uint64_t> bytes;
};

/// Called with the share that is done, now and then.
using ShareDone = std::function<void(double)>;

struct Scene {
  std::string file;
  std::string name;
  std::string description;
  double dt = 1e-3;                ///< s
  std::optional<double> duration;  ///< s; without one, as long as the longest trace
  double deadline = 1e-3;          ///< s
  std::optional<double> budget;    ///< s per step, beyond which bristles are left out
  int threads = 1;
  std::uint32_t out_patches = 8;  ///< patches that the force file holds
  SceneLimits limits;
  std::vector<std::string> traces;  ///< motion files that it names
  std::vector<SceneMaterial> materials;
  std::vector<ScenePatch> patches;
  std::vector<SceneBody> bodies;

  std::size_t patch_count() const noexcept;  ///< copies included
  double trace_length() const noexcept;      ///< s, of the longest trace; 0 without one
};

/// Throws UserError with file, line and key.
Scene read_scene(const std::string& path, const SceneLimits& limits = {}, const ShareDone& progress = {});
Scene parse_scene(const std::string& text, const std::string& path, const SceneLimits& limits = {},
                  const ShareDone& progress = {});

/// Replaces every trace of the scene, or every prescribed motion when it has none, by a motion file; the
/// scene then lasts as long as the file. Throws UserError.
/// `clip_load_n`: as read_motion_file.
void replace_motion(Scene& scene, const std::string& motion_path, double clip_load_n = 0.0);

/// Files that were read: no command that steps the scene may write one of them.
std::vector<FileOption> inputs_of(const Scene& scene);

/// Gives every patch this many representative bristles. Throws UserError when they are too many in all.
void set_bristles(Scene& scene, std::uint32_t bristles);

}  // namespace cli
