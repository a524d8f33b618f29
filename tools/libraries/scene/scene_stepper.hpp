// Makes the patches and bodies of a scene, moves them step by step, and keeps the results of the last step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/scene/body_motion.hpp"
#include "tools/libraries/scene/scene.hpp"

namespace cli {

/// Copy of a patch of the scene. Each copy is one patch of the batch.
struct SceneCopy {
  std::size_t patch = 0;  ///< index of its patch in Scene::patches
  std::string name;
  double delay = 0.0;  ///< time by which the copy moves later, s

  /// Cosine and sine of the angle by which the copy's motion is rotated against that of the first copy.
  double cosine = 1.0, sine = 0.0;
  double axis[2] = {1.0, 0.0};  ///< direction of the copy's first axis in the scene
  Position last;                ///< last position of the prescribed motion, unrotated, m
};

/// Returns the number of time steps in a scene's duration. Throws UserError if they are too many.
std::uint64_t step_count(const Scene& scene);

/// Steps the patches and bodies of a scene. A patch with one axis that moves along another line than the x
/// axis gets its axis turned onto that line.
class SceneStepper {
 public:
  /// Makes the patches and bodies of the scene, which must outlive this object. Throws UserError.
  SceneStepper(const Scene& scene, const bristle::BatchOptions& options, const ShareDone& progress = {});

  /// Sets displacement and load of all patches on prescribed motions, for the step that starts at t (s).
  void prescribe(double t);
  /// Solves the bodies' motions, steps the batch and moves the bodies. Does nothing else, because callers
  /// time this function.
  void step(double t);

  /// Returns positions and velocities of the bodies. With the batch's state they determine all later steps.
  std::vector<double> body_states() const;
  /// Restores what body_states() returned, and sets the prescribed motions to the time after `steps` steps.
  void set_body_states(bristle::Span<const double> body_states, std::uint64_t steps);

  bristle::PatchBatch& batch() { return batch_; }
  const bristle::PatchBatch& batch() const { return batch_; }
  const std::vector<SceneCopy>& copies() const { return copies_; }
  const std::vector<bristle::Motion>& motions() const { return motions_; }
  std::vector<bristle::Motion>& motions() { return motions_; }
  const std::vector<bristle::Response>& responses() const { return responses_; }
  std::vector<bristle::Response>& responses() { return responses_; }
  const std::vector<BodyMotion>& bodies() const { return bodies_; }
  const bristle::StepReport& report() const { return report_; }  ///< returns the batch's report of last step

 private:
  void add_patches(const ShareDone& progress);
  /// Makes copy `number` of a patch. If `line` (a unit vector) is not null, the copy's first axis lies along
  /// it.
  SceneCopy make_copy(std::size_t patch, std::uint32_t number, const double* line) const;
  void add_bodies();

  const Scene& scene_;
  bristle::PatchBatch batch_;
  std::vector<SceneCopy> copies_;
  std::vector<bristle::Motion> motions_;
  std::vector<bristle::Response> responses_;
  std::vector<BodyMotion> bodies_;
  bristle::StepReport report_;
};

}  // namespace cli
