// Patches by key, for engines that list all their contacts in every step.
//
// KeyedPatches assigns the patches of a PatchBatch to contacts by a 64-bit key, which must mean the same
// contact from step to step. It returns to its pool the patches whose key is missing. ContactMatcher makes
// such keys if an engine gives only a pair of bodies and points: it matches each point with the nearest point
// of the previous step.
//
//   keys.match(contacts, key_of_contact)                       // only where the engine has no stable ids
//   motion.id = patches.find_or_add(key)       for each contact
//   batch.step(dt, motions, responses)
//   patches.end_step()
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/config.hpp"
#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/set_field.hpp"
#include "bristle/span.hpp"
#if BRISTLE_WITH_OUTLINES
#include "bristle/extended_patches.hpp"
#endif

namespace bristle {

/// Key that stands for no contact: find_or_add has no patch for it. ContactMatcher gives it to contacts that
/// it has no room for.
constexpr std::uint64_t no_contact_key = ~std::uint64_t{0};

struct KeyedOptions {
  std::uint32_t capacity = 1024;  ///< number of patches, all made at once; 1 to 2^24; reserve() makes more
  /// Number of steps that a key may be missing before its patch returns to the pool.
  std::uint32_t keep_steps = 0;
  /// Whether each key gives its patch a seed of its own, so that contacts differ in their sampled snap
  /// lengths; if not, all have PatchOptions::seed, and a new key costs less.
  bool seed_from_key = true;

  KeyedOptions& with_capacity(std::uint32_t patches) { return detail::set(*this, capacity, patches); }
  KeyedOptions& with_keep_steps(std::uint32_t steps) { return detail::set(*this, keep_steps, steps); }
  KeyedOptions& with_seed_from_key(bool value) { return detail::set(*this, seed_from_key, value); }
};

/// Patch of a contact and an index for the caller's own data, as KeyedPatches::find_or_add_contact returns
/// them.
struct KeyedContact {
  PatchId id;  ///< id of the contact's patch, or PatchId::no_capacity() if there is none
  /// Index for arrays of the caller: 0 to capacity - 1, fixed while the contact lasts; capacity if it has no
  /// patch.
  std::uint32_t index = 0;
  /// Whether the contact was added by this call. Data that the caller keeps at `index` then belong to an
  /// earlier contact and must be reset.
  bool is_new = false;
};

/// The calls that pools of patches (KeyedPatches) and of beds (KeyedBeds) have in common.
class BRISTLE_API KeyedPool {
 public:
  /// Removes the patches or beds of the pool from the batch, which must still live.
  ~KeyedPool();
  KeyedPool(KeyedPool&&) noexcept;
  KeyedPool& operator=(KeyedPool&&) noexcept;

  /// Raises the capacity, between steps; contacts keep their patches, and a lower number changes nothing. It
  /// adds to the batch and uses the pool at once, so no other thread may call either meanwhile. Throws
  /// bristle::Error.
  void reserve(std::uint32_t capacity);

  /// Puts the patch of this contact back into the pool now. Returns false if the contact has no patch.
  bool remove(std::uint64_t key) noexcept;
  void clear() noexcept;  ///< gives all patches back to the pool; refused() becomes 0

  /// Ends the step of the pool: takes the patches from contacts whose keys were missing for more than
  /// keep_steps, and returns their number. Call it once per step, after the last find_or_add; without it no
  /// contact ever ends.
  std::uint32_t end_step() noexcept;

  /// Returns the number of bytes that save_state writes: constant until reserve() raises the capacity.
  std::size_t state_size() const noexcept;
  /// Writes the record of which contact has which patch; returns the bytes written, 0 if `to` is too small.
  /// The states of the bristles are not in it: save the batch (ExtendedPatches, BedBatch) too.
  std::size_t save_state(Span<std::byte> to) const noexcept;
  /// Restores what save_state wrote into a pool made with the same options at the same position among its
  /// batch's pools. Call it after restore_state of the batch (or the extended patches). Allocates. Throws
  /// bristle::Error, and changes nothing, if it does not fit the pool or the present state of its patches. A
  /// bed does not know its key, so nothing checks that a pool of beds and its batch belong together.
  void restore_state(Span<const std::byte> from);

  std::uint32_t size() const noexcept;      ///< number of contacts that have a patch at present
  std::uint32_t capacity() const noexcept;  ///< number of patches of the pool
  std::uint64_t refused() const noexcept;   ///< number of times that find_or_add had no patch, so far

  struct Impl;

 protected:
  explicit KeyedPool(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

/// A pool of patches of one material, found by key. For several materials make several pools over one batch.
///
/// The patch of a new key behaves to the bit like one newly added to the batch with PatchOptions::seed =
/// seed_of(key) and PatchOptions::key = key. Forces therefore do not depend on the order in which contacts
/// appeared and ended. A contact that was lost for longer than keep_steps starts with a fresh patch. The
/// energy stored in its bristles is dropped; to have it reported as contact_loss, step the patch once with
/// load 0.
///
/// Thread rule: that of PatchBatch.
/// The batch (or the extended patches) must outlive it and must not be moved. Nothing allocates but making
/// it, destroying it, reserve and restore_state.
class BRISTLE_API KeyedPatches : public KeyedPool {
 public:
  /// Makes a pool of options.capacity patches, which it adds to the batch as a group (groups()). `patch.seed`
  /// is mixed into the seeds of the contacts. Throws bristle::Error.
  KeyedPatches(PatchBatch& batch, const Material& material, const PatchOptions& patch,
               const KeyedOptions& options = {});
#if BRISTLE_WITH_OUTLINES
  /// Makes a pool of options.capacity extended patches of one outline; its ids are valid in `patches`. After
  /// find_or_add, give each contact its size by ExtendedPatches::set_scale. Throws bristle::Error.
  KeyedPatches(ExtendedPatches& patches, const Material& material, const PatchOptions& patch,
               const Outline& outline, const KeyedOptions& options = {});
#endif
  /// Returns the groups of the pool's patches, which the caller may step by arrays (GroupStep) that are
  /// indexed by KeyedContact::index, with those indices in GroupStep::which. The second and later groups,
  /// one for each reserve(), follow after the first. A pool of extended patches has none.
  Span<const PatchGroup> groups() const noexcept;

  /// Returns the patch of this contact, with straight bristles if the key is new; the key counts as seen in
  /// this step. Returns PatchId::no_capacity() if all patches are in use, or for no_contact_key. refused()
  /// counts these cases; a motion with that id returns zero force and Status::no_capacity.
  PatchId find_or_add(std::uint64_t key) noexcept;
  /// Finds or adds a contact like find_or_add(), and also returns an index at which the caller may keep data
  /// of the contact (as ContactFrames does).
  KeyedContact find_or_add_contact(std::uint64_t key) noexcept;
  /// Looks up the patch of this contact without keeping the contact alive: the key does not count as seen.
  /// Returns PatchId{} if there is none.
  PatchId find(std::uint64_t key) const noexcept;

  struct Entry {
    std::uint64_t key;
    PatchId id;
  };
  /// Writes key and patch of the current contacts, as many as fit, in the order in which they were last seen,
  /// which depends on the calls alone. Returns the total number.
  std::size_t read_entries(Span<Entry> out) const noexcept;

  /// Returns the seed of the random numbers of a contact's patch.
  std::uint32_t seed_of(std::uint64_t key) const noexcept;
};

/// A contact as an engine lists it, without an id that lasts; ContactMatcher makes a key from it.
struct ContactPoint {
  std::uint64_t pair = 0;  ///< name of the two bodies or geoms, the same in every step

  /// Position of the contact, m, in a frame in which the point hardly moves. Take the centre of the smaller
  /// body and that body's axes or, if the body is round and may roll, the world's axes. In the world frame
  /// the points of a fast pair would move out of reach.
  double point[3] = {0.0, 0.0, 0.0};
};

struct MatcherOptions {
  std::uint32_t capacity = 1024;  ///< largest number of contacts of one step; 1 to 2^24
  double reach = 1e-3;            ///< largest distance at which a contact is found again, m, > 0
  std::uint32_t keep_steps = 0;   ///< number of steps that a contact may be missing and still be found again

  MatcherOptions& with_capacity(std::uint32_t contacts) { return detail::set(*this, capacity, contacts); }
  MatcherOptions& with_reach(double metres) { return detail::set(*this, reach, metres); }
  MatcherOptions& with_keep_steps(std::uint32_t steps) { return detail::set(*this, keep_steps, steps); }
};

/// A contact that the engine does not list in this step although its pair of bodies still touches elsewhere.
/// ContactMatcher keeps it (set_hold), so that its friction is not lost.
struct HeldContact {
  std::uint64_t key = 0;
  ContactPoint contact;  ///< the contact as the caller last listed it
};

/// Gives contacts lasting keys, by pair of bodies and nearest point of the previous step.
///
/// Matches old and new points of a pair within reach: the shortest distance first, then the shortest of the
/// rest, and so on; ties go to the contact listed first. Keys depend on the pair and its
/// earlier contacts, not on other pairs, so results do not depend on events elsewhere. A new contact
/// may get the key of a forgotten one, so keep_steps of KeyedPatches must not be larger than the matcher's.
///
/// After set_hold(), friction belongs to the pair of surfaces. A contact whose point is not listed is held
/// while its pair has another one, and a new point of a pair with as many contacts gets the key of the
/// nearest of them. held_load() (contact_frame.hpp) then divides the load of the pair among its contacts, and
/// friction acts where they are. release() ends a held contact, such as one whose point has left the other
/// surface.
///
/// Thread rule: one side (PatchBatch). Nothing allocates but the constructor, reserve and restore_state.
class BRISTLE_API ContactMatcher {
 public:
  /// Makes a matcher with memory for `options.capacity` contacts in a step. Throws bristle::Error for an
  /// option out of range.
  explicit ContactMatcher(const MatcherOptions& options = {});
  ~ContactMatcher();
  ContactMatcher(ContactMatcher&&) noexcept;
  ContactMatcher& operator=(ContactMatcher&&) noexcept;

  /// Gives keys to all contacts of one step; keys[i] names contacts[i]. The key is no_contact_key if the
  /// point is not finite, and for contacts beyond the capacity or beyond the length of `keys`. Returns the
  /// number of contacts found again. The cost is of the order of the number of contacts times the contacts P
  /// of one pair. At worst it is the number times P^2, if a row of contacts moved further than its own length
  /// and all of it lies within reach.
  ///
  /// `normals`: unit normals, three numbers a contact, in the frames of the points; empty if all of a pair's
  /// are alike. Contacts whose normals differ by more than 45 degrees are different ones.
  std::size_t match(Span<const ContactPoint> contacts, Span<std::uint64_t> keys,
                    Span<const double> normals = {}) noexcept;
  /// Keeps this number of contacts of a pair while the pair touches, whatever points of its surfaces the
  /// engine lists. Take 4 for engines that list other points from step to step. With 0, the default, a
  /// contact ends when its point is not listed.
  void set_hold(std::uint32_t contacts) noexcept;
  /// Returns whether contacts[i] of the last match() continues a contact that the engine listed elsewhere on
  /// the same two surfaces (after set_hold).
  bool has_joined(std::size_t i) const noexcept;
  /// Returns the contacts that the last match() kept although the engine did not list them (after set_hold).
  Span<const HeldContact> held() const noexcept;
  /// Ends a held contact before the next match(); returns false if none has this key.
  bool release(std::uint64_t key) noexcept;
  void reserve(std::uint32_t contacts);  ///< raises the capacity; throws bristle::Error
  std::uint32_t capacity() const noexcept;
  void clear() noexcept;  ///< forgets all contacts; later ones may get their keys: clear KeyedPatches too

  /// Returns the number of bytes that save_state writes, which depends on the number of contacts that the
  /// next match() can find again. State functions work as in KeyedPatches. restore_state throws
  /// bristle::Error, and changes nothing, for a damaged state or one of more than 2 x capacity contacts.
  std::size_t state_size() const noexcept;
  std::size_t save_state(Span<std::byte> to) const noexcept;
  void restore_state(Span<const std::byte> from);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle
