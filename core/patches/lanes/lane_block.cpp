#include "core/patches/lanes/lane_block.hpp"

#include <algorithm>
#include <bit>

namespace bristle::detail {

void set_load(Patch& p, double normal_load_n) noexcept {
  const PatchRecord& r = *p.record;
  p.normal_load = normal_load_n;
  p.zeta = p.material().material.bristles_in_contact(normal_load_n);
  p.overload = std::max(p.zeta / (r.full_weight * r.options.bristles), 1.0);
  if (p.overload < 1.0 + 1e-14) p.overload = 1.0;
  note_contact(p);
}

/// A taken lane, which its record's head owns.
struct LanePlaces::Place {
  std::shared_ptr<LanePlaces> places;
  LaneBlock* block;
  std::uint32_t lane;

  Place(std::shared_ptr<LanePlaces> of, LaneBlock* in, std::uint32_t at)
      : places(std::move(of)), block(in), lane(at) {}
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  ~Place() { places->give_back(*block, lane); }
};

void LanePlaces::take(LaneRecord& record, std::uint64_t kind, Block (*make)(const LaneRecord&)) {
  Kind& its = kinds_[kind];
  std::vector<LaneBlock*>& open = its.open;
  if (open.empty()) {
    Block made = make(record);
    made->kind = kind;
    open.reserve(its.blocks + 1);  // reserved here, so that give_back() cannot fail
    LaneBlock* const block = made.get();
    blocks_.emplace(block, std::move(made));
    ++its.blocks;
    open.push_back(block);
  }
  LaneBlock& block = *open.back();
  const auto lane = static_cast<std::uint32_t>(std::countr_zero(block.free));
  head_of(record).place = std::make_shared<Place>(shared_from_this(), &block, lane);
  block.free &= ~(1u << lane);
  if (block.free == 0) open.pop_back();
  record.block = &block;
  record.lane = lane;
}

void LanePlaces::give_back(LaneBlock& block, std::uint32_t lane) noexcept {
  const auto found = kinds_.find(block.kind);
  std::vector<LaneBlock*>& open = found->second.open;
  if (block.free == 0) open.push_back(&block);
  block.free |= 1u << lane;
  if (block.free != (1u << lane_count) - 1) return;
  open.erase(std::find(open.begin(), open.end(), &block));
  blocks_.erase(&block);
  if (--found->second.blocks == 0) kinds_.erase(found);
}

}  // namespace bristle::detail
