#include <vector>

#include "../reseal.hpp"
#include "steps.hpp"
#include "targets.hpp"

namespace fuzz {
namespace {

using bristle::Response;

/// Three small patches of different kinds, bent and in contact.
struct Batch {
  bristle::PatchBatch batch;
  std::vector<bristle::PatchId> ids;
  std::vector<std::byte> bent;

  Batch() {
    using bristle::PatchOptions;
    using bristle::SnapLength;
    const auto add = [this](const SnapLength& law, bristle::SnapRule rule, const PatchOptions& options) {
      ids.push_back(batch.add(bristle::Material{}.with_snap_length(law).with_snap_rule(rule), options));
    };
    add(SnapLength::exponential(1e-5), bristle::SnapRule::redraw,
        PatchOptions{}.with_bristles(20).with_outputs(bristle::Outputs::all));
    add(SnapLength::uniform(5e-6, 15e-6), bristle::SnapRule::keep,
        PatchOptions{}.with_bristles(7).with_axes(1).with_precision(bristle::Precision::double_));
    add(SnapLength::lognormal(1e-5, 0.3), bristle::SnapRule::keep, PatchOptions{}.with_bristles(270));
    step(0.7e-5, 0.9);
    step(0.4e-5, 0.45);
    bent = saved_state(batch);
  }
  void step(double dx, double load) {
    std::vector<bristle::Motion> in(ids.size());
    std::vector<Response> out(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      in[i].id = ids[i];
      in[i].displacement[0] = dx;
      in[i].normal_load = load;
    }
    batch.step(1e-3, in, out);
    for (const Response& r : out) check_finite(r);
  }
};

/// Makes a saved state from the fuzzer's input. If the first byte is even, the other bytes are the state; if
/// odd, they change a good state: two bytes say where, a third the new value.
std::vector<std::byte> make_state(Bytes bytes, const std::vector<std::byte>& bent) {
  std::vector<std::byte> state;
  if (bytes.empty()) return state;
  if (bytes[0] & 1) {
    state = bent;
    for (std::size_t i = 1; i + 2 < bytes.size(); i += 3)
      state[(bytes[i] * 256u + bytes[i + 1]) % state.size()] = static_cast<std::byte>(bytes[i + 2]);
  } else {
    for (std::size_t i = 1; i < bytes.size(); ++i) state.push_back(static_cast<std::byte>(bytes[i]));
  }
  if (bytes[0] & 2) bristle_test::reseal(state);
  return state;
}

}  // namespace

void state(Bytes bytes) {
  static Batch subject;
  subject.batch.restore_state(subject.bent);
  const std::uint64_t before = subject.batch.state_hash();
  const std::vector<std::byte> state = make_state(bytes, subject.bent);
  try {
    subject.batch.restore_state(state);
  } catch (const bristle::Error&) {
    check(subject.batch.state_hash() == before, "a state that is refused changes nothing");
    return;
  }
  const std::uint64_t hash = subject.batch.state_hash();
  const std::vector<std::byte> again = saved_state(subject.batch);
  for (const double load : {0.5, 0.0, 2.0, 0.3})
    for (const double dx : {0.0, 1e-6, -3e-5, 1.0}) subject.step(dx, load);
  subject.batch.restore_state(again);
  check(subject.batch.state_hash() == hash, "a state saved again is the same");
}

}  // namespace fuzz
