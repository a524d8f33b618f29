// Stands in for beds in a build with BRISTLE_MINIMAL, which has none.
#include "bristle/bed.hpp"
#include "bristle/error.hpp"

namespace bristle {

namespace {
[[noreturn]] void refuse_beds() {
  throw Error("BedBatch: left out of this library; build it with BRISTLE_MINIMAL=OFF");
}
}  // namespace

struct BedBatch::Impl {};

BedBatch::BedBatch(const BatchOptions&) { refuse_beds(); }
BedBatch::~BedBatch() = default;
BedBatch::BedBatch(BedBatch&&) noexcept = default;
BedBatch& BedBatch::operator=(BedBatch&&) noexcept = default;
BedId BedBatch::add(const BedMaterial&, const BedShape&, const BedOptions&) { refuse_beds(); }
void BedBatch::remove(BedId) { refuse_beds(); }
StepReport BedBatch::step(Span<const BedMotion>, Span<BedResponse>) noexcept { return {}; }
BedResponse BedBatch::find_force(const BedMotion&) noexcept { return {}; }
bool BedBatch::reset(BedId) noexcept { return false; }
BedInfo BedBatch::info(BedId) const noexcept { return {}; }
std::size_t BedBatch::read_bristles(BedId, Span<BedBristle>) const noexcept { return 0; }
std::uint64_t BedBatch::state_hash(BedId) const noexcept { return 0; }
std::uint64_t BedBatch::state_hash() const noexcept { return 0; }
std::size_t BedBatch::state_size() const noexcept { return 0; }
std::size_t BedBatch::save_state(Span<std::byte>) const noexcept { return 0; }
void BedBatch::restore_state(Span<const std::byte>) { refuse_beds(); }
std::size_t BedBatch::bed_count() const noexcept { return 0; }
int BedBatch::threads() const noexcept { return 0; }
const char* BedBatch::isa() const noexcept { return ""; }
BedShape BedShape::from_pressure(double, double, int, int, const std::function<double(double, double)>&) {
  refuse_beds();
}

}  // namespace bristle
