#include "tools/libraries/scene/scene_memory.hpp"

#include <map>
#include <string>
#include <tuple>

#include <fmt/format.h>

#include <bristle/error.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

constexpr std::uint64_t beside_a_patch = 1900;  // bytes that a copy of a patch needs beside its bristles

// Bytes of memory that every machine has. A scene that needs less is not checked against the free memory.
constexpr std::uint64_t surely_there = 128 << 20;

/// Returns an upper bound on the bytes that a patch of representatives with these options takes.
std::uint64_t at_most(const bristle::PatchOptions& o) {
  constexpr std::uint64_t most_bristle = 45, fixed = 2048;
  return fixed + most_bristle * (o.bristles ? o.bristles : 4096);
}

/// Estimates memory: asks the library for the bytes of patches with few bristles, and extrapolates to the
/// number in the scene.
class Probe {
 public:
  explicit Probe(const Scene& scene) : scene_(scene) {}

  std::uint64_t bytes_of(const ScenePatch& patch) {
    bristle::PatchOptions options = patch.options;
    const bool infinite = options.population == bristle::Population::infinite;
    if (!infinite && options.bristles > few) options.bristles = few;
    const auto kind = std::tuple(patch.material, infinite, options.bristles, options.axes, options.precision,
                                 options.resolution, options.max_normal_load);
    const auto [found, is_new] = known_.try_emplace(kind);
    if (is_new) found->second = ask(scene_.materials[patch.material].material, options);
    const auto& [bytes, per_bristle] = found->second;
    if (infinite || patch.options.bristles <= few) return bytes;
    return bytes + (patch.options.bristles - few) * per_bristle + (patch.options.bristles / few - 1) * block;
  }

 private:
  static constexpr std::uint32_t few = 256;  // number of bristles of a trial patch, and of a block
  static constexpr std::uint64_t block = 72;
  struct Bytes {
    std::uint64_t patch = 0, per_bristle = 0;
  };

  static Bytes ask(const bristle::Material& material, const bristle::PatchOptions& options) {
    try {
      bristle::PatchBatch batch;
      const bristle::PatchInfo info = batch.info(batch.add(material, options));
      return {info.memory_bytes, info.bytes_per_representative};
    } catch (const bristle::Error&) {
      return {};  // no estimate: the run itself will report the error with its place
    }
  }

  const Scene& scene_;
  std::map<std::tuple<std::size_t, bool, std::uint32_t, int, bristle::Precision, double, double>, Bytes>
      known_;
};

std::string size_text(std::uint64_t bytes) {
  const double mebibytes = static_cast<double>(bytes) / (1 << 20);
  return mebibytes < 1024.0 ? fmt::format("{:.0f} MiB", mebibytes)
                            : fmt::format("{:.1f} GiB", mebibytes / 1024.0);
}

}  // namespace

std::uint64_t estimate_memory(const Scene& scene) {
  Probe probe(scene);
  std::uint64_t bytes = 0;
  for (const ScenePatch& patch : scene.patches)
    bytes += patch.count * (probe.bytes_of(patch) + beside_a_patch);
  return bytes;
}

void check_memory(const Scene& scene) {
  Probe probe(scene);
  std::uint64_t most = 0;
  for (const ScenePatch& patch : scene.patches) {
    const bool infinite = patch.options.population == bristle::Population::infinite;
    most += patch.count * ((infinite ? probe.bytes_of(patch) : at_most(patch.options)) + beside_a_patch);
  }
  const std::uint64_t allowed = scene.limits.bytes.value_or(surely_there);
  if (most <= allowed) return;
  const std::uint64_t needed = estimate_memory(scene);
  const std::uint64_t there = scene.limits.bytes ? allowed : platform::free_memory();
  if (needed <= there) return;
  throw UserError(
      fmt::format("{}: {} patches need about {} of memory, and {} are {}; give fewer bristles, or "
                  "--memory {}M to take so much",
                  scene.file, scene.patch_count(), size_text(needed), size_text(there),
                  scene.limits.bytes ? "allowed (--memory)" : "free", (needed >> 20) + 1));
}

}  // namespace cli
