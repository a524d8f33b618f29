// Measures how much memory a contact takes, how large its saved state is, and how long saving and restoring
// take.
#include <cstddef>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"

namespace cli {
namespace {

constexpr int contact_count = 100;

SnapshotRow measure(const char* what, const bristle::PatchOptions& contact, const CapacityOptions& options) {
  bristle::PatchBatch batch(
      bristle::BatchOptions{}.with_isa(options.isa.empty() ? nullptr : options.isa.c_str()));
  const std::size_t empty = batch.state_size();
  std::vector<bristle::Motion> motions;
  for (int i = 0; i < contact_count; ++i)
    motions.push_back({batch.add(bristle::Material::from_coefficients({}), contact), {1e-6, 0.0}, 1.0});
  std::vector<bristle::Response> responses(contact_count);
  batch.warm_up();
  for (int i = 0; i < 100; ++i) batch.step(capacity_dt_s, motions, responses);

  std::vector<std::byte> state(batch.state_size());
  const auto save = [&] { return static_cast<double>(batch.save_state(state)); };
  const auto restore = [&] {
    batch.restore_state(state);
    return 0.0;
  };
  const std::vector<ComparisonRow> times =
      compare({{"save", save, {}}, {"restore", restore, {}}}, "", contact_count, options.quick ? 15 : 61);
  SnapshotRow row;
  row.what = what;
  row.memory_bytes = batch.info(motions.front().id).memory_bytes;
  row.state_bytes = (state.size() - empty) / contact_count;
  row.batch_bytes = empty;
  row.save_ns = times[0].ns.median;
  row.restore_ns = times[1].ns.median;
  return row;
}

}  // namespace

std::vector<SnapshotRow> measure_snapshots(const CapacityOptions& options) {
  const auto infinite = bristle::PatchOptions{}.with_population(bristle::Population::infinite);
  return {
      measure("infinite brush, default", infinite, options),
      measure("infinite brush, resolution 4", bristle::PatchOptions(infinite).with_resolution(4.0), options),
      measure("100 bristles", bristle::PatchOptions{}.with_bristles(100), options),
      measure("1,000 bristles", bristle::PatchOptions{}.with_bristles(1000), options)};
}

}  // namespace cli
