// Makes a scene's patches and bodies, moves them step by step, and keeps the results of the last step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/scene/body_motion.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

/// Copy of a [[patch]] of the scene, which is one patch of the batch.
struct SceneCopy {
  std::size_t patch = 0;  ///< index into Scene::patches
  std::string name;
  double delay = 0.0;  ///< s

  /// Cosine and sine of the angle by which this copy's motion is rotated.
  double cosine = 1.0, sine = 0.0;
  double axis[2] = {1.0, 0.0};  ///< direction of the patch's first axis in the scene
  Position last;                ///< last position of the copy's motion, m, before its rotation
};

/// Returns the number of steps in the scene's duration. Throws UserError if they are too many.
std::uint64_t step_count(const Scene& scene);

/// Steps a scene. A patch with one axis that moves along a line other than the x axis gets its axis rotated
/// onto that line, which scene files cannot ask for.
class SceneStepper {
 public:
  /// Makes the patches and bodies of the scene, which must outlive this object. Throws UserError.
  SceneStepper(const Scene& scene, const bristle::BatchOptions& options, const ShareDone& progress = {});

  /// Sets displacements and loads, over the step from t on, of all patches that no body moves.
  void prescribe(double t);
  /// Solves the bodies' motion, steps the batch, and moves the bodies. Does nothing else, since callers time
  /// it.
  void step(double t);

  /// Returns places and velocities of the bodies. With the state of the batch they determine all later steps.
  std::vector<double> places() const;
  /// Restores what places() returned after `steps` steps, and moves the prescribed motions to that time.
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
  /// Makes copy `number` of a patch, with its first axis along `line` unless that is null.
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
