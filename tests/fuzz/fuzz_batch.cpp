#include <algorithm>
#include <vector>

#include "steps.hpp"
#include "targets.hpp"

namespace fuzz {
namespace {

using bristle::Motion;
using bristle::PatchBatch;
using bristle::PatchId;
using bristle::Response;
using bristle::Status;

constexpr Status refusals =
    Status::unknown_id | Status::repeated_id | Status::bad_input | Status::no_capacity;

/// Model of what a batch promises: which patches exist, with which materials and options.
struct Model {
  struct Patch {
    PatchId id;
    bristle::PatchOptions options;
  };
  std::vector<Patch> patches;
  std::vector<PatchId> gone;

  const Patch* find(PatchId id) const {
    const auto at = std::find_if(patches.begin(), patches.end(), [&](const Patch& p) { return p.id == id; });
    return at == patches.end() ? nullptr : &*at;
  }
};

/// Two batches under test: the second, the twin, gets the same calls but uses another instruction set and
/// visits every bristle.
class Session {
 public:
  explicit Session(Bytes bytes)
      : input_(bytes),
        batch_(bristle::BatchOptions{}.with_threads(input_.choice(32) == 31 ? 2 : 1)),
        twin_(stepped_eagerly(bristle::BatchOptions{}.with_isa("scalar"), input_.flag())) {}

  void run() {
    for (int k = 0; k < 40 && !input_.empty(); ++k) {
      switch (input_.choice(12)) {
        case 0:
        case 1:
          add();
          break;
        case 2:
          remove();
          break;
        case 3:
          set_material();
          break;
        case 4:
          save();
          break;
        case 5:
          restore();
          break;
        case 6:
          find_force();
          break;
        default:
          step();
      }
      check(batch_.patch_count() == model_.patches.size(), "there are as many patches as were added");
    }
    check_all();
  }

 private:
  /// Returns the id of a patch that exists, of one that was removed, or of none.
  PatchId any_id() {
    const unsigned kind = input_.choice(8);
    if (kind == 7) return {input_.bits(8)};
    const std::vector<PatchId>& gone = model_.gone;
    if (kind == 6 && !gone.empty()) return gone[input_.choice(static_cast<unsigned>(gone.size()))];
    if (model_.patches.empty()) return {};
    return model_.patches[input_.choice(static_cast<unsigned>(model_.patches.size()))].id;
  }

  /// Makes a call on both batches and checks that both carry it out, or both refuse.
  template <class Call>
  bool both(const Call& call) {
    bool done[2];
    PatchBatch* const batches[] = {&batch_, &twin_};
    for (int i = 0; i < 2; ++i) {
      try {
        call(*batches[i]);
        done[i] = true;
      } catch (const bristle::Error& error) {
        check(*error.what() != 0, "a refusal says why");
        done[i] = false;
      }
    }
    check(done[0] == done[1], "both batches take a call or both refuse it");
    return done[0];
  }

  void add() {
    if (model_.patches.size() >= 6) return;
    try {
      const bristle::Material material = any_material(input_);
      const bristle::PatchOptions options = any_options(input_, input_.choice(32) == 31 ? 8000 : 300);
      PatchId ids[2];
      std::size_t count = 0;
      if (!both([&](PatchBatch& batch) { ids[count++] = batch.add(material, options); })) return;
      check(ids[0] && ids[0] == ids[1], "the same calls give the same ids");
      check(model_.find(ids[0]) == nullptr, "an id is new");
      check(std::find(model_.gone.begin(), model_.gone.end(), ids[0]) == model_.gone.end(),
            "an id never comes again");
      model_.patches.push_back({ids[0], options});
      kept_.clear();                   // saved states fit only a batch with the same patches
    } catch (const bristle::Error&) {  // the library refused the random law, so no patch exists
    }
  }

  void remove() {
    const PatchId id = any_id();
    const bool there = model_.find(id) != nullptr;
    check(both([&](PatchBatch& batch) { batch.remove(id); }) == there,
          "only a patch that is there is removed");
    if (!there) return;
    model_.patches.erase(std::find_if(model_.patches.begin(), model_.patches.end(),
                                      [&](const Model::Patch& p) { return p.id == id; }));
    model_.gone.push_back(id);
    kept_.clear();
  }

  void set_material() {
    const PatchId id = any_id();
    const bool there = model_.find(id) != nullptr;
    try {
      const bristle::Material material = any_material(input_);
      const bool done = both([&](PatchBatch& batch) { batch.set_material(id, material); });
      check(there || !done, "only a patch that is there gets a material");
      if (done) kept_.clear();
    } catch (const bristle::Error&) {
    }
  }

  void save() {
    kept_ = saved_state(batch_);
    check(kept_ == saved_state(twin_), "the twin's state has the same bytes");
    kept_hash_ = batch_.state_hash();
    std::vector<std::byte> small(kept_.size() - 1);
    check(batch_.save_state(small) == 0, "a buffer too small is left alone");
  }

  void restore() {
    if (kept_.empty()) return;
    std::vector<std::byte> state = kept_;
    const bool damaged = input_.choice(4) == 3;
    if (damaged) state[input_.bits(2) % state.size()] ^= static_cast<std::byte>(1u << input_.choice(8));
    const std::uint64_t before = batch_.state_hash();
    const bool done = both([&](PatchBatch& batch) { batch.restore_state(state); });
    check(done != damaged, "a state is restored unless it is damaged");
    check(batch_.state_hash() == (damaged ? before : kept_hash_), "restored or as it was");
    check_all();
  }

  void find_force() {
    const PatchId id = any_id();
    const Model::Patch* patch = model_.find(id);
    const Motion motion = any_motion(input_, id, patch ? patch->options.axes : 2, 1e-5);
    const double dt = any_time();
    const std::uint64_t before = batch_.state_hash();
    const Response response = batch_.find_force(dt, motion);
    check_same(response, twin_.find_force(dt, motion), "find_force answers alike");
    check_finite(response);
    check_id(id, response.status);
    check(batch_.state_hash() == before, "find_force changes nothing");
    // Checks that a real step returns the response that find_force() predicted.
    if (has(response.status, refusals) || input_.flag()) return;
    Response stepped;
    stepped.id = id;
    step_both(dt, {&motion, 1}, {&stepped, 1});
    check_same(response, stepped, "find_force foretells the step");
  }

  double any_time() { return input_.choice(16) == 15 ? input_.number(1e-3) : 1e-3; }

  void step() {
    std::vector<Motion> in(input_.choice(6));
    for (Motion& m : in) {
      const PatchId id = any_id();
      const Model::Patch* patch = model_.find(id);
      m = any_motion(input_, id, patch ? patch->options.axes : 2, 1e-5);
    }
    const bool wrong_length = input_.choice(16) == 15;
    std::vector<Response> out(in.size() + (wrong_length ? 1 : 0));
    step_both(any_time(), in, out);
    if (wrong_length)
      for (const Response& r : out)
        check(r.status == Status::bad_input, "spans of unlike length are refused");
  }

  void step_both(double dt, bristle::Span<const Motion> in, bristle::Span<Response> out) {
    std::vector<Response> other(out.begin(), out.end());
    const bool steps = dt > 0.0 && std::isnormal(dt) && in.size() == out.size();
    const std::uint64_t before = batch_.state_hash();
    const bristle::StepReport report = batch_.step(dt, in, out);
    const bristle::StepReport twin_report = twin_.step(dt, in, other);
    check(report.status == twin_report.status && report.patches_stepped == twin_report.patches_stepped,
          "both batches report alike");
    Status all = Status::ok;
    std::uint32_t stepped = 0;
    for (std::size_t i = 0; i < out.size(); ++i) {
      check_same(out[i], other[i], "both batches answer alike");
      check_finite(out[i]);
      all = all | out[i].status;
      stepped += has(out[i].status, refusals) ? 0 : 1;
      if (steps) check_status(in, i, out[i].status);
    }
    if (steps) check(all == report.status && stepped == report.patches_stepped, "the report sums up");
    if (stepped == 0 || !steps) check(batch_.state_hash() == before, "what is refused changes nothing");
  }

  /// Checks that a status names an id that no patch has, and apart from it the id that a full pool gives.
  void check_id(PatchId id, Status status) const {
    const bool full = id == PatchId::no_capacity();
    check(has(status, Status::no_capacity) == full, "only the id of a full pool is named as such");
    check(has(status, Status::unknown_id) == (!full && model_.find(id) == nullptr),
          "an id is unknown where there is no such patch");
  }

  void check_status(bristle::Span<const Motion> in, std::size_t i, Status status) const {
    const bool there = model_.find(in[i].id) != nullptr;
    check_id(in[i].id, status);
    const bool repeated =
        std::any_of(in.begin(), in.begin() + i, [&](const Motion& m) { return m.id == in[i].id; });
    check(has(status, Status::repeated_id) == (there && repeated), "an id is repeated from the second on");
    const double load = in[i].normal_load;
    const bool bad = !std::isfinite(in[i].displacement[0]) || !std::isfinite(in[i].displacement[1]) ||
                     !(load >= 0.0 && load <= 1e15);
    if (there && !repeated && bad) check(has(status, Status::bad_input), "bad numbers are refused");
  }

  void check_all() {
    check(batch_.state_hash() == twin_.state_hash(), "both batches are in the same state");
    for (const Model::Patch& patch : model_.patches) {
      const bristle::PatchInfo info = batch_.info(patch.id);
      check(info.representatives == patch.options.bristles, "a patch has its bristles");
      check(info.active >= 0.0 && info.active <= info.representatives,
            "no more of them touch than there are");
      const double energy = batch_.stored_energy(patch.id);
      check(energy >= 0.0 && energy == twin_.stored_energy(patch.id), "stored energy is one number");
    }
    for (const PatchId id : model_.gone)
      check(batch_.info(id).representatives == 0, "a removed id stays unknown");
  }

  Input input_;
  Model model_;
  PatchBatch batch_, twin_;
  std::vector<std::byte> kept_;
  std::uint64_t kept_hash_ = 0;
};

}  // namespace

void batch(Bytes bytes) { Session(bytes).run(); }

}  // namespace fuzz
