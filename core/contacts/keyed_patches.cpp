#include "bristle/keyed_patches.hpp"

#include <utility>
#include <vector>

#include "core/common/assert.hpp"
#include "core/common/range_check.hpp"
#include "core/contacts/key_table.hpp"
#include "core/contacts/sealed_bytes.hpp"
#include "core/runtime/stepping_side.hpp"

namespace bristle {

using detail::ByteReader;
using detail::ByteWriter;
using detail::KeyTable;
using detail::mix_key;
using detail::SteppingCall;
using detail::SteppingSide;

namespace {

constexpr std::uint32_t most = 1u << 24;
constexpr std::uint32_t none = KeyTable::none;

constexpr std::uint64_t saved_magic = 0x7379'656b'7473'7262;  // "brstkeys"
constexpr std::size_t saved_head = detail::seal_size + 3 * 8 + 2 * 4, saved_place = 4 + 2 * 8;

std::uint32_t check_capacity(const char* where, std::uint32_t capacity) {
  if (capacity < 1 || capacity > most) detail::refuse(where, "capacity", capacity, "1 to 16777216");
  return capacity;
}

/// Whose patches the pool has.
struct Owner {
  PatchBatch* batch = nullptr;
  ExtendedPatches* extended = nullptr;

  void remove(PatchId id) const { extended != nullptr ? extended->remove(id) : batch->remove(id); }
  void reset(PatchId id, std::uint32_t seed, std::uint64_t key) const noexcept {
    extended != nullptr ? extended->reset(id, seed, key) : batch->reset(id, seed, key);
  }
  /// Key of the patch itself, or of its first cell; 0 if there is no such patch.
  std::uint64_t key_of(PatchId id) const noexcept {
    if (extended == nullptr) return batch->info(id).key;
    const Span<const PatchId> cells = extended->cell_patches(id);
    return cells.empty() ? 0 : extended->batch().info(cells[0]).key;
  }
};

}  // namespace

struct KeyedPatches::Impl {
  /// A patch of the pool. Held ones hang in a list, the longest unseen first.
  struct Held {
    PatchId id;
    std::uint64_t key = 0;
    std::uint64_t seen = 0;  ///< number of the step
    std::uint32_t before = none, after = none;
  };

  /// `add` makes one patch in the owner.
  template <class Add>
  Impl(const Owner& its_owner, const PatchOptions& patch, const KeyedOptions& its_options, Add&& add)
      : owner(its_owner),
        options(its_options),
        seed(patch.seed),
        table(check_capacity("KeyedOptions", its_options.capacity)) {
    pool.reserve(options.capacity);
    free.reserve(options.capacity);
    try {
      for (std::uint32_t i = 0; i < options.capacity; ++i) {
        pool.emplace_back();
        pool.back().id = add();
      }
    } catch (...) {
      pool.pop_back();
      remove_patches();
      throw;
    }
    for (std::uint32_t i = options.capacity; i-- > 0;) free.push_back(i);
  }
  ~Impl() { remove_patches(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void remove_patches() noexcept {
    for (const Held& held : pool) {
      try {
        owner.remove(held.id);
      } catch (...) {  // somebody else removed it, or there is no memory for the command
      }
    }
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
    const Held& held = pool[i];
    BRISTLE_ASSERT(held.before == none ? first == i : pool[held.before].after == i);
    BRISTLE_ASSERT(held.after == none ? last == i : pool[held.after].before == i);
    (held.before == none ? first : pool[held.before].after) = held.after;
    (held.after == none ? last : pool[held.after].before) = held.before;
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

  /// Calls `visit` for each place of the pool: the held ones, the longest unseen first, then the free ones.
  template <class Visit>
  void for_each_place(Visit&& visit) const {
    for (std::uint32_t i = first; i != none; i = pool[i].after) visit(i, pool[i].key, pool[i].seen);
    for (const std::uint32_t i : free) visit(i, no_contact_key, std::uint64_t{0});
  }

  SteppingSide stepping_side;
  const Owner owner;
  const KeyedOptions options;
  const std::uint32_t seed;
  std::vector<Held> pool;
  std::vector<std::uint32_t> free;  ///< the one last given back comes first: its memory is warm
  KeyTable table;                   ///< key to place in the pool
  std::uint32_t first = none, last = none;
  std::uint64_t step = 0;
  std::uint64_t refused = 0;
};

KeyedPatches::KeyedPatches(PatchBatch& batch, const Material& material, const PatchOptions& patch,
                           const KeyedOptions& options)
    : impl_(std::make_unique<Impl>(Owner{&batch, nullptr}, patch, options,
                                   [&] { return batch.add(material, patch); })) {}
KeyedPatches::KeyedPatches(ExtendedPatches& patches, const Material& material, const PatchOptions& patch,
                           const Outline& outline, const KeyedOptions& options)
    : impl_(std::make_unique<Impl>(Owner{nullptr, &patches}, patch, options,
                                   [&] { return patches.add(material, patch, outline); })) {}
KeyedPatches::~KeyedPatches() = default;
KeyedPatches::KeyedPatches(KeyedPatches&&) noexcept = default;
KeyedPatches& KeyedPatches::operator=(KeyedPatches&&) noexcept = default;

PatchId KeyedPatches::find_or_add(std::uint64_t key) noexcept {
  const SteppingCall call(impl_->stepping_side);
  Impl& impl = *impl_;
  if (key == no_contact_key) return {};
  std::uint32_t i = impl.table.find(key);
  if (i != none) {
    impl.unlink(i);
  } else {
    if (impl.free.empty()) {
      ++impl.refused;
      return {};
    }
    i = impl.free.back();
    impl.free.pop_back();
    impl.pool[i].key = key;
    impl.table.insert(key, i);
    impl.owner.reset(impl.pool[i].id, impl.seed_of(key), key);
  }
  impl.append(i);
  impl.pool[i].seen = impl.step;
  return impl.pool[i].id;
}

PatchId KeyedPatches::find(std::uint64_t key) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  const std::uint32_t i = key == no_contact_key ? none : impl_->table.find(key);
  return i == none ? PatchId{} : impl_->pool[i].id;
}

bool KeyedPatches::remove(std::uint64_t key) noexcept {
  const SteppingCall call(impl_->stepping_side);
  const std::uint32_t i = key == no_contact_key ? none : impl_->table.find(key);
  if (i == none) return false;
  impl_->give_back(i);
  return true;
}

void KeyedPatches::clear() noexcept {
  const SteppingCall call(impl_->stepping_side);
  while (impl_->last != none) impl_->give_back(impl_->last);
  impl_->refused = 0;
}

std::uint32_t KeyedPatches::end_step() noexcept {
  const SteppingCall call(impl_->stepping_side);
  Impl& impl = *impl_;
  std::uint32_t count = 0;
  for (; impl.first != none && impl.step - impl.pool[impl.first].seen > impl.options.keep_steps; ++count)
    impl.give_back(impl.first);
  ++impl.step;
  return count;
}

std::size_t KeyedPatches::read_entries(Span<Entry> out) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  std::size_t k = 0;
  for (std::uint32_t i = impl_->first; i != none && k < out.size(); i = impl_->pool[i].after)
    out[k++] = {impl_->pool[i].key, impl_->pool[i].id};
  return size();
}

std::size_t KeyedPatches::state_size() const noexcept { return saved_head + capacity() * saved_place; }

std::size_t KeyedPatches::save_state(Span<std::byte> to) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  const Impl& impl = *impl_;
  if (to.size() < state_size()) return 0;
  ByteWriter write(to.data() + detail::seal_size);
  write(impl.pool[0].id.value);
  write(impl.step);
  write(impl.refused);
  write(capacity());
  write(size());
  impl.for_each_place([&](std::uint32_t place, std::uint64_t key, std::uint64_t seen) {
    write(place);
    write(key);
    write(seen);
  });
  detail::seal({to.data(), state_size()}, saved_magic);
  return state_size();
}

void KeyedPatches::restore_state(Span<const std::byte> from) {
  const SteppingCall call(impl_->stepping_side);
  Impl& impl = *impl_;
  const auto fail = [](const char* why) { detail::refuse_saved("KeyedPatches", why); };
  ByteReader read = detail::open_sealed("KeyedPatches", from, saved_magic);
  if (from.size() != state_size()) fail("is of a pool with another capacity");
  PatchId first_patch;
  std::uint64_t step = 0, refused = 0, last_seen = 0;
  std::uint32_t places = 0, held = 0;
  read(first_patch.value);
  read(step);
  read(refused);
  read(places);
  read(held);
  if (first_patch != impl.pool[0].id || places != capacity()) fail("is of another pool");
  if (held > places) fail("holds more keys than patches");
  std::vector<Impl::Held> pool = impl.pool;
  std::vector<std::uint32_t> order;
  std::vector<char> named(places, 0);
  KeyTable table(places);
  for (std::uint32_t k = 0; k < places; ++k) {
    std::uint32_t i = 0;
    std::uint64_t key = 0, seen = 0;
    read(i);
    read(key);
    read(seen);
    if (i >= places || named[i]) fail("names a patch that is not there, or twice");
    named[i] = 1;
    order.push_back(i);
    if (k >= held) continue;
    if (key == no_contact_key || table.find(key) != none || seen < last_seen || seen > step)
      fail("has a key or a time that no contact can have");
    if (impl.owner.key_of(pool[i].id) != key)
      fail("does not belong to the present state of the patches: restore theirs first");
    table.insert(key, i);
    pool[i].key = key;
    pool[i].seen = last_seen = seen;
  }
  impl.pool.swap(pool);
  impl.table = std::move(table);
  impl.first = impl.last = none;
  for (std::uint32_t k = 0; k < held; ++k) impl.append(order[k]);
  impl.free.assign(order.begin() + held, order.end());
  impl.step = step;
  impl.refused = refused;
}

std::uint32_t KeyedPatches::size() const noexcept {
  const SteppingCall call(impl_->stepping_side);
  return capacity() - static_cast<std::uint32_t>(impl_->free.size());
}
std::uint32_t KeyedPatches::capacity() const noexcept { return impl_->options.capacity; }
std::uint64_t KeyedPatches::refused() const noexcept { return impl_->refused; }
std::uint32_t KeyedPatches::seed_of(std::uint64_t key) const noexcept { return impl_->seed_of(key); }

}  // namespace bristle
