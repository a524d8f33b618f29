// Groups: many contacts of one material and one set of options, moved by plain arrays instead of a Motion and
// a Response each.
//
//   const bristle::PatchGroup group = batch.add_group(rubber, options, n);
//   bristle::GroupStep step;
//   step.group = group;
//   step.displacement[0] = dx;  // arrays of n numbers each
//   step.displacement[1] = dy;
//   step.normal_load = load;
//   step.end[0] = fx;
//   step.end[1] = fy;
//   batch.step(dt, step);
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "bristle/patch.hpp"
#include "bristle/span.hpp"

namespace bristle {

constexpr std::size_t max_group_size = 1u << 26;  ///< largest number of contacts of a group

/// Contacts that PatchBatch::add_group added together. Each has a patch id of its own, valid in all functions
/// that take one.
struct PatchGroup {
  PatchId first;            ///< id of contact 0
  std::uint32_t count = 0;  ///< number of contacts

  PatchGroup() = default;
  PatchGroup(PatchId first_id, std::uint32_t contacts) noexcept : first(first_id), count(contacts) {}
  std::size_t size() const noexcept { return count; }
  PatchId operator[](std::size_t contact) const noexcept { return {first.value + contact}; }
};

/// A step of a group: arrays of the caller, with one number for each contact of the group, in the order of
/// their indices. PatchBatch reads and writes them there. Numbers are those of Motion and Response.
struct GroupStep {
  PatchGroup group;

  // --- input
  Span<const double> displacement[2] = {};  ///< displacement, m; the second array may be empty with one axis
  Span<const double> normal_load = {};      ///< N
  /// Slip velocity, m/s; empty arrays mean displacement / dt. Give both or none.
  Span<const double> velocity[2] = {};
  /// Indices of the contacts that move, within the group; an empty array means all. Other contacts rest under
  /// their last load, and their numbers are neither read nor written. All other arrays still have the whole
  /// group's length.
  std::optional<Span<const std::uint32_t>> which = {};

  // --- output of a step: an array that is empty, or that the options of the group do not compute, is not
  // written
  Span<double> end[2] = {};        ///< N
  Span<double> elastic[2] = {};    ///< N
  Span<double> damper[2] = {};     ///< N
  Span<double> mean[2] = {};       ///< N (Outputs::mean)
  Span<double> stiffness = {};     ///< N/m
  Span<double> damping = {};       ///< N s/m
  Span<double> force_limit = {};   ///< N
  Span<double> dissipated = {};    ///< J (Outputs::energy)
  Span<double> contact_loss = {};  ///< J (Outputs::energy)
  Span<double> damper_work = {};   ///< J (Outputs::energy)
  Span<std::uint64_t> snaps = {};  ///< (Outputs::energy)
  Span<Status> status = {};
};

}  // namespace bristle
