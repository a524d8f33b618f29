// Steps a scene: makes its patches and bodies, moves them, and keeps what came out of the last step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/scene/body_motion.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

/// A copy of a [[patch]]: one contact patch of the batch.
struct SceneCopy {
  std::size_t patch = 0;  ///< index into Scene::patches
  std::string name;
  double delay = 0.0;               ///< s
  double cosine = 1.0, sine = 0.0;  ///< of the turn of its directions
  double axis[2] = {1.0, 0.0};      ///< where the patch's first axis points
  Position last;                    ///< of the unturned motion
};

/// Steps of the scene's dt that its duration holds. Throws UserError when they are too many.
std::uint64_t step_count(const Scene& scene);

/// A patch with one axis whose motion stays on a line that is not the x axis has its axis turned onto that
/// line (scene files cannot ask for that).
class SceneStepper {
 public:
  /// The scene must outlive it. Throws UserError.
  SceneStepper(const Scene& scene, const bristle::BatchOptions& options, const ShareDone& progress = {});

  /// Displacements and loads of all patches that no body carries, over the step from t on.
  void prescribe(double t);
  /// Solves the bodies' step, steps the batch, moves the bodies. Nothing else: this is what gets timed.
  void step(double t);

  /// Where bodies are and how fast, beside the state of the batch: what the next steps depend on.
  std::vector<double> places() const;
  /// As many as places() gives, after `steps` steps: prescribed motions are taken to where they were then.
  void set_places(bristle::Span<const double> places, std::uint64_t steps);

  bristle::PatchBatch& batch() { return batch_; }
  const bristle::PatchBatch& batch() const { return batch_; }
  const std::vector<SceneCopy>& copies() const { return copies_; }
  const std::vector<bristle::Motion>& motions() const { return motions_; }
  std::vector<bristle::Motion>& motions() { return motions_; }
  const std::vector<bristle::Response>& responses() const { return responses_; }
  const std::vector<BodyMotion>& bodies() const { return bodies_; }
  const bristle::StepReport& report() const { return report_; }  ///< of the last step

 private:
  void add_patches(const ShareDone& progress);
  /// `line`: onto which the axis is turned; null: it stays.
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
