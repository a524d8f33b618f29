#include "bristle/keyed_patches.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "core/common/assert.hpp"
#include "core/common/check_fields.hpp"
#include "core/common/little_endian.hpp"
#include "core/common/saved_head.hpp"
#include "core/contacts/key_table.hpp"
#include "core/runtime/stepping_side.hpp"
#if BRISTLE_WITH_BEDS
#include "bristle/keyed_beds.hpp"
#endif

namespace bristle {

using detail::KeyTable;
using detail::mix_key;
using detail::SteppingCall;

namespace {

constexpr std::uint32_t none = KeyTable::none;

/// Bit in the saved step number of a contact. It is set while find_or_add_contact has not yet returned the
/// contact, whose next answer must then say is_new.
constexpr std::uint64_t saved_untold = std::uint64_t{1} << 63;
constexpr std::size_t saved_head = detail::saved_head_size + 3 * 8 + 4, saved_entry = 4 + 2 * 8;

/// Numbers of a saved pool, and of each of its entries, with and without a key.
struct SavedPool {
  std::uint64_t first_id = 0, step = 0, refused = 0;
  std::uint32_t capacity = 0;
};
struct SavedEntry {
  std::uint32_t index = 0;
  std::uint64_t key = 0, seen = 0;
};
template <class Pool, class Io>
void pool_fields(Pool& p, Io& io) noexcept {
  io(p.first_id);
  io(p.step);
  io(p.refused);
  io(p.capacity);
}
template <class Entry, class Io>
void entry_fields(Entry& p, Io& io) noexcept {
  io(p.index);
  io(p.key);
  io(p.seen);
}

std::uint32_t check_capacity(const char* where, std::uint32_t capacity) {
  detail::require_fields(where, KeyedOptions{}.with_capacity(capacity));
  return capacity;
}

/// The object to which the patches or beds of a pool belong (PatchBatch, ExtendedPatches, BedBatch), and
/// those of its functions that the pool calls. Ids are valid in this object.
struct Owner {
  void* it;
  /// Removes one object, or a group of `count` patches whose first is `id`.
  void (*remove)(void* it, std::uint64_t id, std::uint32_t count);
  void (*reset)(void* it, std::uint64_t id, std::uint32_t seed, std::uint64_t key) noexcept;
  /// Returns the key of a patch, or of the first cell of an outline, to check a restored pool; 0 if there is
  /// no such patch, and no value for beds, which have no keys.
  std::optional<std::uint64_t> (*key_of)(void* it, std::uint64_t id) noexcept;
};

template <class Patches>
void reset_patch(void* it, std::uint64_t id, std::uint32_t seed, std::uint64_t key) noexcept {
  static_cast<Patches*>(it)->reset({id}, seed, key);
}

Owner owner_of(PatchBatch& batch) {
  return {&batch,
          [](void* it, std::uint64_t id, std::uint32_t count) {
            static_cast<PatchBatch*>(it)->remove(PatchGroup({id}, count));
          },
          &reset_patch<PatchBatch>,
          [](void* it, std::uint64_t id) noexcept -> std::optional<std::uint64_t> {
            return static_cast<PatchBatch*>(it)->info({id}).key;
          }};
}

#if BRISTLE_WITH_OUTLINES
Owner owner_of(ExtendedPatches& patches) {
  return {&patches,
          [](void* it, std::uint64_t id, std::uint32_t) { static_cast<ExtendedPatches*>(it)->remove({id}); },
          &reset_patch<ExtendedPatches>,
          [](void* it, std::uint64_t id) noexcept -> std::optional<std::uint64_t> {
            const ExtendedPatches& extended = *static_cast<ExtendedPatches*>(it);
            const Span<const PatchId> cells = extended.cell_patches({id});
            return cells.empty() ? 0 : extended.batch().info(cells[0]).key;
          }};
}
#endif

#if BRISTLE_WITH_BEDS
Owner owner_of(BedBatch& beds) {
  return {&beds, [](void* it, std::uint64_t id, std::uint32_t) { static_cast<BedBatch*>(it)->remove({id}); },
          [](void* it, std::uint64_t id, std::uint32_t, std::uint64_t) noexcept {
            static_cast<BedBatch*>(it)->reset({id});
          },
          [](void*, std::uint64_t) noexcept -> std::optional<std::uint64_t> { return std::nullopt; }};
}
#endif

}  // namespace

struct BRISTLE_PRIVATE KeyedPool::Impl {
  /// Entry of a pool: a patch or bed, and the contact that uses it, if any. Entries in use form a list; at
  /// its head is the contact that has not been requested for longest, so expired contacts are found at once.
  struct PoolEntry {
    std::uint64_t id = 0;
    std::uint64_t key = 0;
    std::uint64_t seen = 0;  ///< number of the step in which the contact's key was last requested
    std::uint32_t before = none, after = none;
    bool told = false;  ///< whether find_or_add_contact has returned this contact before
  };

  /// Adds `count` patches or beds to the owner, and entries for them to the pool, which has room for them.
  using Grow = std::function<void(Impl&, std::uint32_t count)>;

  Impl(const char* its_name, const Owner& its_owner, std::uint32_t its_seed, const KeyedOptions& its_options,
       Grow its_grow)
      : name(its_name),
        owner(its_owner),
        options(its_options),
        seed(its_seed),
        grow(std::move(its_grow)),
        table(check_capacity("KeyedOptions", its_options.capacity)) {
    options.capacity = 0;
    reserve(its_options.capacity);
  }
  ~Impl() { remove_patches(0); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Removes all entries but the first `kept` from the pool, and their patches or beds from the owner.
  void remove_patches(std::size_t kept) noexcept {
    while (pool.size() > kept) {
      const std::uint32_t count = groups.empty() ? 1 : groups.back().count;
      if (!groups.empty()) groups.pop_back();
      try {
        owner.remove(owner.it, pool[pool.size() - count].id, count);
      } catch (...) {  // ignored: the patch or bed was already removed, or there is no memory for the command
      }
      pool.resize(pool.size() - count);
    }
  }

  void reserve(std::uint32_t capacity) {
    const SteppingCall call(stepping_side);
    const std::uint32_t before = options.capacity;
    if (capacity <= before) return;
    KeyTable its_table(check_capacity(name, capacity));
    for (std::uint32_t i = first; i != none; i = pool[i].after) its_table.insert(pool[i].key, i);
    pool.reserve(capacity);
    free.reserve(capacity);
    try {
      grow(*this, capacity - before);
    } catch (...) {
      remove_patches(before);
      throw;
    }
    table = std::move(its_table);
    // Puts the new entries at the end of the free list from which entries are taken last, in ascending order.
    const auto at = free.insert(free.begin(), capacity - before, 0u);
    std::generate(at, at + (capacity - before), [next = capacity]() mutable { return --next; });
    options.capacity = capacity;
  }

  void append(std::uint32_t i) noexcept {
    BRISTLE_ASSERT(i < pool.size());
    BRISTLE_ASSERT((first == none) == (last == none));
    pool[i].before = last;
    pool[i].after = none;
    (last == none ? first : pool[last].after) = i;
    last = i;
  }
  void unlink(std::uint32_t i) noexcept {
    const PoolEntry& entry = pool[i];
    BRISTLE_ASSERT(entry.before == none ? first == i : pool[entry.before].after == i);
    BRISTLE_ASSERT(entry.after == none ? last == i : pool[entry.after].before == i);
    (entry.before == none ? first : pool[entry.before].after) = entry.after;
    (entry.after == none ? last : pool[entry.after].before) = entry.before;
  }
  void give_back(std::uint32_t i) noexcept {
    BRISTLE_ASSERT(table.find(pool[i].key) == i);
    BRISTLE_ASSERT(free.size() < pool.size());
    table.erase(pool[i].key);
    unlink(i);
    free.push_back(i);
  }
  std::uint32_t seed_of(std::uint64_t key) const noexcept {
    return options.seed_from_key ? static_cast<std::uint32_t>(mix_key(mix_key(key) + seed)) : seed;
  }

  /// Calls `visit` for each entry of the pool: first for those in use, beginning with the contact not
  /// requested for longest, then for the free ones.
  template <class Visit>
  void for_each_entry(Visit&& visit) const {
    for (std::uint32_t i = first; i != none; i = pool[i].after)
      visit(i, pool[i].key, pool[i].seen | (pool[i].told ? 0 : saved_untold));
    for (const std::uint32_t i : free) visit(i, no_contact_key, std::uint64_t{0});
  }

  /// Finds the contact of a key, or gives it a free entry. `tells`: whether the caller reads
  /// KeyedContact::is_new.
  KeyedContact find_or_add(std::uint64_t key, bool tells = false) noexcept {
    const SteppingCall call(stepping_side);
    std::uint32_t i = key == no_contact_key ? none : table.find(key);
    if (i != none) {
      unlink(i);
    } else {
      if (free.empty() || key == no_contact_key) {
        ++refused;
        return {PatchId::no_capacity(), options.capacity, true};
      }
      i = free.back();
      free.pop_back();
      pool[i].key = key;
      pool[i].told = false;
      table.insert(key, i);
      owner.reset(owner.it, pool[i].id, seed_of(key), key);
    }
    append(i);
    pool[i].seen = step;
    const bool is_new = !pool[i].told;
    pool[i].told |= tells;
    return {{pool[i].id}, i, is_new};
  }

  std::uint64_t find(std::uint64_t key) const noexcept {
    const SteppingCall call(stepping_side);
    const std::uint32_t i = key == no_contact_key ? none : table.find(key);
    return i == none ? 0 : pool[i].id;
  }

  bool erase(std::uint64_t key) noexcept {
    const SteppingCall call(stepping_side);
    const std::uint32_t i = key == no_contact_key ? none : table.find(key);
    if (i == none) return false;
    give_back(i);
    return true;
  }

  void clear() noexcept {
    const SteppingCall call(stepping_side);
    while (last != none) give_back(last);
    refused = 0;
  }

  std::uint32_t end_step() noexcept {
    const SteppingCall call(stepping_side);
    std::uint32_t count = 0;
    for (; first != none && step - pool[first].seen > options.keep_steps; ++count) give_back(first);
    ++step;
    return count;
  }

  std::uint32_t size() const noexcept {
    const SteppingCall call(stepping_side);
    return options.capacity - static_cast<std::uint32_t>(free.size());
  }

  std::size_t state_size() const noexcept { return saved_head + options.capacity * saved_entry; }
  std::size_t save_state(Span<std::byte> to) const noexcept {
    const SteppingCall call(stepping_side);
    if (to.size() < state_size()) return 0;
    detail::ByteWriter write(to.data() + detail::saved_head_size);
    const SavedPool saved{pool[0].id, step, refused, options.capacity};
    pool_fields(saved, write);
    for_each_entry([&](std::uint32_t index, std::uint64_t key, std::uint64_t seen) {
      const SavedEntry its{index, key, seen};
      entry_fields(its, write);
    });
    detail::seal(detail::SavedKind::keys, size(), {to.data(), state_size()});
    return state_size();
  }

  void restore_state(Span<const std::byte> from) {
    const SteppingCall call(stepping_side);
    const auto fail = [this](const char* why) { detail::refuse_saved(name, why); };
    const std::uint64_t keyed = detail::open_sealed(name, detail::SavedKind::keys, from);
    if (from.size() != state_size()) fail("is of a pool with another capacity");
    detail::ByteReader read(from.data() + detail::saved_head_size);
    SavedPool saved;
    pool_fields(saved, read);
    const std::uint32_t capacity = saved.capacity;
    if (saved.first_id != pool[0].id || capacity != options.capacity) fail("is of another pool");
    if (keyed > capacity) fail("has more keys than patches");
    std::vector<PoolEntry> its_pool = pool;
    std::vector<std::uint32_t> order;
    std::vector<char> named(capacity, 0);
    KeyTable its_table(capacity);
    std::uint64_t last_seen = 0;
    for (std::uint32_t k = 0; k < capacity; ++k) {
      SavedEntry its;
      entry_fields(its, read);
      const std::uint32_t i = its.index;
      const std::uint64_t key = its.key, seen = its.seen & ~saved_untold;
      if (i >= capacity || named[i]) fail("names a patch that is not there, or twice");
      named[i] = 1;
      order.push_back(i);
      if (k >= keyed) continue;
      if (key == no_contact_key || its_table.find(key) != none || seen < last_seen || seen > saved.step)
        fail("has a key or a time that no contact can have");
      if (owner.key_of(owner.it, pool[i].id).value_or(key) != key)
        fail("does not belong to the present state of the patches: restore theirs first");
      its_table.insert(key, i);
      its_pool[i].key = key;
      its_pool[i].seen = last_seen = seen;
      its_pool[i].told = (its.seen & saved_untold) == 0;
    }
    pool.swap(its_pool);
    table = std::move(its_table);
    first = last = none;
    for (std::uint32_t k = 0; k < keyed; ++k) append(order[k]);
    free.assign(order.begin() + keyed, order.end());
    step = saved.step;
    refused = saved.refused;
  }

  const char* const name;
  mutable detail::SteppingSide stepping_side;
  const Owner owner;
  KeyedOptions options;
  const std::uint32_t seed;
  const Grow grow;
  std::vector<PoolEntry> pool;
  /// Groups that the patches of the pool are in, in the order of its entries; none for outlines and beds.
  std::vector<PatchGroup> groups;
  /// Indices of the free entries. The one freed last is used first, because it is likely still in the cache.
  std::vector<std::uint32_t> free;
  KeyTable table;  ///< maps a key to its index in the pool
  std::uint32_t first = none, last = none;
  std::uint64_t step = 0;
  std::uint64_t refused = 0;
};

namespace {

/// Returns a function that adds objects to a pool, which have ids of their own, one by one.
template <class Add>
auto one_by_one(const Add& add) {
  return [add](auto& to, std::uint32_t count) {
    for (; count > 0; --count) {
      const std::uint64_t id = add();
      to.pool.emplace_back().id = id;
    }
  };
}

}  // namespace

KeyedPool::KeyedPool(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
KeyedPool::~KeyedPool() = default;
KeyedPool::KeyedPool(KeyedPool&&) noexcept = default;
KeyedPool& KeyedPool::operator=(KeyedPool&&) noexcept = default;
void KeyedPool::reserve(std::uint32_t capacity) { impl_->reserve(capacity); }
bool KeyedPool::remove(std::uint64_t key) noexcept { return impl_->erase(key); }
void KeyedPool::clear() noexcept { impl_->clear(); }
std::uint32_t KeyedPool::end_step() noexcept { return impl_->end_step(); }
std::size_t KeyedPool::state_size() const noexcept { return impl_->state_size(); }
std::size_t KeyedPool::save_state(Span<std::byte> to) const noexcept { return impl_->save_state(to); }
void KeyedPool::restore_state(Span<const std::byte> from) { impl_->restore_state(from); }
std::uint32_t KeyedPool::size() const noexcept { return impl_->size(); }
std::uint32_t KeyedPool::capacity() const noexcept { return impl_->options.capacity; }
std::uint64_t KeyedPool::refused() const noexcept { return impl_->refused; }

KeyedPatches::KeyedPatches(PatchBatch& batch, const Material& material, const PatchOptions& patch,
                           const KeyedOptions& options)
    : KeyedPool(std::make_unique<Impl>("KeyedPatches", owner_of(batch), patch.seed, options,
                                       [&batch, material, patch](Impl& to, std::uint32_t count) {
                                         to.groups.reserve(to.groups.size() + 1);
                                         const PatchGroup group = batch.add_group(material, patch, count);
                                         to.groups.push_back(group);
                                         for (std::uint32_t i = 0; i < count; ++i)
                                           to.pool.emplace_back().id = group[i].value;
                                       })) {}
#if BRISTLE_WITH_OUTLINES
KeyedPatches::KeyedPatches(ExtendedPatches& patches, const Material& material, const PatchOptions& patch,
                           const Outline& outline, const KeyedOptions& options)
    : KeyedPool(std::make_unique<Impl>("KeyedPatches", owner_of(patches), patch.seed, options,
                                       one_by_one([&patches, material, patch, outline] {
                                         return patches.add(material, patch, outline).value;
                                       }))) {}
#endif
PatchId KeyedPatches::find_or_add(std::uint64_t key) noexcept { return impl_->find_or_add(key).id; }
KeyedContact KeyedPatches::find_or_add_contact(std::uint64_t key) noexcept {
  return impl_->find_or_add(key, true);
}
PatchId KeyedPatches::find(std::uint64_t key) const noexcept { return {impl_->find(key)}; }
Span<const PatchGroup> KeyedPatches::groups() const noexcept { return impl_->groups; }
std::size_t KeyedPatches::read_entries(Span<Entry> out) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  std::size_t k = 0;
  for (std::uint32_t i = impl_->first; i != none && k < out.size(); i = impl_->pool[i].after)
    out[k++] = {impl_->pool[i].key, {impl_->pool[i].id}};
  return size();
}
std::uint32_t KeyedPatches::seed_of(std::uint64_t key) const noexcept { return impl_->seed_of(key); }

#if BRISTLE_WITH_BEDS
KeyedBeds::KeyedBeds(BedBatch& beds, const BedMaterial& material, const BedShape& shape,
                     const BedOptions& bed, const KeyedOptions& options)
    : KeyedPool(std::make_unique<Impl>(
          "KeyedBeds", owner_of(beds), 0u, options,
          one_by_one([&beds, material, shape, bed] { return beds.add(material, shape, bed).value; }))) {}
BedId KeyedBeds::find_or_add(std::uint64_t key) noexcept { return {impl_->find_or_add(key).id.value}; }
BedId KeyedBeds::find(std::uint64_t key) const noexcept { return {impl_->find(key)}; }
#endif

}  // namespace bristle
