// Steps a scene: makes its patches and bodies, moves them, and keeps the results of the last step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/scene/body_motion.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

/// Copy of a [[patch]]: one contact patch of the batch.
struct SceneCopy {
  std::size_t patch = 0;  ///< index into Scene::patches
  std::string name;
  double delay = 0.0;  ///< s
  /// Cosine and sine of the angle by which the copy's directions are turned.
  double cosine = 1.0, sine = 0.0;
  double axis[2] = {1.0, 0.0};  ///< direction of the patch's first axis
  Position last;                ///< last position, by the unturned motion
};

/// Returns the number of steps in the scene's duration. Throws UserError when they are too many.
std::uint64_t step_count(const Scene& scene);

/// Stepper of a scene. A patch with one axis that moves along another line than the x axis gets its axis
/// turned onto that line (scene files cannot ask for that).
class SceneStepper {
 public:
  /// Makes patches and bodies. The scene must outlive this. Throws UserError.
  SceneStepper(const Scene& scene, const bristle::BatchOptions& options, const ShareDone& progress = {});

  /// Sets displacements and loads of all patches without a body, over the step from t on.
  void prescribe(double t);
  /// Solves the bodies' step, steps the batch, and moves the bodies. It does nothing else, as this is what is
  /// timed.
  void step(double t);

  /// Returns places and velocities of the bodies: with the batch's state, all that the next steps depend on.
  std::vector<double> places() const;
  /// Sets the numbers of places() as after `steps` steps, and moves the prescribed motions to that time.
  void set_places(bristle::Span<const double> places, std::uint64_t steps);

  bristle::PatchBatch& batch() { return batch_; }
  const bristle::PatchBatch& batch() const { return batch_; }
  const std::vector<SceneCopy>& copies() const { return copies_; }
  const std::vector<bristle::Motion>& motions() const { return motions_; }
  std::vector<bristle::Motion>& motions() { return motions_; }
  const std::vector<bristle::Response>& responses() const { return responses_; }
  const std::vector<BodyMotion>& bodies() const { return bodies_; }
  const bristle::StepReport& report() const { return report_; }  ///< returns the report of the last step

 private:
  void add_patches(const ShareDone& progress);
  /// Makes a copy. Its axis is turned onto `line`, unless that is null.
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
