// Patches by name: for engines that make their list of contacts anew in every step.
//
// KeyedPatches hands out the patches of a PatchBatch by a 64-bit key that means the same contact from step to
// step, and takes back those whose key is no longer asked for. ContactMatcher makes such keys where an engine
// gives only a pair of bodies and points: each point is matched with the nearest of the step before.
//
//   keys.match(contacts, key_of_contact)                       // only where the engine has no stable ids
//   motion.id = patches.find_or_add(key)       for each contact
//   batch.step(dt, motions, responses)
//   patches.end_step()
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Names no contact: find_or_add answers it with PatchId{}.
constexpr std::uint64_t no_contact_key = ~std::uint64_t{0};

struct KeyedOptions {
  std::uint32_t capacity = 1024;  ///< patches, all made at once; 1 to 2^24
  std::uint32_t keep_steps = 0;   ///< steps that a key may be missing before its patch goes back
  bool seed_from_key = true;      ///< false: all have PatchOptions::seed, and a new key costs less

  KeyedOptions& with_capacity(std::uint32_t patches) {
    capacity = patches;
    return *this;
  }
  KeyedOptions& with_keep_steps(std::uint32_t steps) {
    keep_steps = steps;
    return *this;
  }
  KeyedOptions& with_seed_from_key(bool value) {
    seed_from_key = value;
    return *this;
  }
};

/// A pool of patches of one material, found by key. For several materials make several pools over one batch.
///
/// A patch that a new key gets behaves to the bit like one newly added to the batch with
/// PatchOptions::seed = seed_of(key) and PatchOptions::key = key, whoever had it before: forces do not depend
/// on the order in which contacts came and went. A contact that was lost for longer than keep_steps begins
/// anew; the energy that its bristles held is forgotten (to have it booked as contact_loss, step it once with
/// load 0).
///
/// Thread rule: made and destroyed by the thread that adds patches to the batch, used by the thread that
/// steps it; the batch must outlive it and stay where it is (not be moved). Nothing but making and destroying
/// it allocates.
class BRISTLE_API KeyedPatches {
 public:
  /// Adds options.capacity patches to the batch. Throws bristle::Error. `patch.seed` is mixed into the seeds.
  KeyedPatches(PatchBatch& batch, const Material& material, const PatchOptions& patch,
               const KeyedOptions& options = {});
  /// Removes them.
  ~KeyedPatches();
  KeyedPatches(KeyedPatches&&) noexcept;
  KeyedPatches& operator=(KeyedPatches&&) noexcept;

  /// The patch of this contact, a fresh one when the key is new; the key counts as seen in this step.
  /// PatchId{} when all patches are taken (see refused()) or for no_contact_key: a motion with it is answered
  /// with zero force and Status::unknown_id.
  PatchId find_or_add(std::uint64_t key) noexcept;
  /// The patch of this contact, PatchId{} where there is none. Does not count as seen.
  PatchId find(std::uint64_t key) const noexcept;
  /// Gives the patch of this contact back now. False where there is none.
  bool remove(std::uint64_t key) noexcept;
  void clear() noexcept;  ///< gives all back; refused() becomes 0

  /// Call once a step, after the last find_or_add: keys not seen for more than keep_steps go back. Returns
  /// how many.
  std::uint32_t end_step() noexcept;

  struct Entry {
    std::uint64_t key;
    PatchId id;
  };
  /// Writes the contacts held, in the order in which they were last seen, as many as fit. Returns how many
  /// there are. An order that depends on the calls alone.
  std::size_t read_entries(Span<Entry> out) const noexcept;

  std::uint32_t size() const noexcept;      ///< contacts held
  std::uint32_t capacity() const noexcept;  ///< patches
  std::uint64_t refused() const noexcept;   ///< new keys that found no patch, so far
  /// Seed of a contact's patch.
  std::uint32_t seed_of(std::uint64_t key) const noexcept;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

/// A contact as an engine lists it.
struct ContactPoint {
  std::uint64_t pair = 0;             ///< names the two bodies or geoms; the same from step to step
  double point[3] = {0.0, 0.0, 0.0};  ///< m; better in the frame of one of the two than in the world's, where
                                      ///< a fast pair outruns its own points
};

struct MatcherOptions {
  std::uint32_t capacity = 1024;  ///< contacts of one step; 1 to 2^24
  double reach = 1e-3;            ///< m, > 0: the farthest that a contact is looked for from where it was
  std::uint32_t keep_steps = 0;   ///< steps that a contact may be missing and still be found again

  MatcherOptions& with_capacity(std::uint32_t contacts) {
    capacity = contacts;
    return *this;
  }
  MatcherOptions& with_reach(double metres) {
    reach = metres;
    return *this;
  }
  MatcherOptions& with_keep_steps(std::uint32_t steps) {
    keep_steps = steps;
    return *this;
  }
};

/// Gives contacts keys that last, by pair of bodies and nearest point of the step before.
///
/// Of all matches between old and new points of a pair within reach the shortest is made first, then the
/// shortest of the rest, and so on; ties go to the contact listed first. Keys depend on the pair and on which
/// of its contacts were there before, not on other pairs, so that results do not depend on what happens
/// elsewhere. Use keep_steps no larger in KeyedPatches than here.
///
/// Thread rule: one thread. Only the constructor allocates.
class BRISTLE_API ContactMatcher {
 public:
  /// Throws bristle::Error.
  explicit ContactMatcher(const MatcherOptions& options = {});
  ~ContactMatcher();
  ContactMatcher(ContactMatcher&&) noexcept;
  ContactMatcher& operator=(ContactMatcher&&) noexcept;

  /// All contacts of one step; keys[i] names contacts[i] (no_contact_key where a point is not finite, and for
  /// those beyond the capacity or beyond the length of `keys`). Returns how many were found again. Cost: of
  /// the order of the contacts, times the contacts P of one pair; at worst times P^2, where a row of contacts
  /// went farther than its own length and all of it lies within reach.
  std::size_t match(Span<const ContactPoint> contacts, Span<std::uint64_t> keys) noexcept;
  void clear() noexcept;  ///< forgets all contacts

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle
