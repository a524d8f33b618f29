#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "bristle/keyed_patches.hpp"
#include "core/common/assert.hpp"
#include "core/common/check_fields.hpp"
#include "core/common/little_endian.hpp"
#include "core/common/saved_head.hpp"
#include "core/contacts/key_table.hpp"
#include "core/patches/fields.hpp"

namespace bristle {

using detail::KeyTable;
using detail::mix_key;

namespace {

constexpr std::uint32_t none = KeyTable::none;

constexpr std::size_t saved_point = 7 * 8 + 3 * 4;
// Cosine of the largest angle between the normals of a contact in two steps. Points whose normals differ
// more, such as those on two faces of a box, are different contacts.
constexpr double least_cosine = 0.70710678118654752;

std::uint64_t key_of(std::uint64_t pair, std::uint32_t ordinal) noexcept {
  const std::uint64_t key = mix_key(mix_key(pair) + ordinal);
  return key == no_contact_key ? 0 : key;
}

/// Calls `visit` with each saved number of a contact. Saving and restoring share this list, so they agree on
/// the order.
template <class Point, class Visit>
void point_fields(Point& p, const MatcherOptions& options, Visit&& visit) noexcept {
  constexpr double most = std::numeric_limits<double>::max();
  visit(p.pair);
  for (auto& x : p.at) visit(x, detail::FieldRule{"point", -most, most});
  for (auto& x : p.normal) visit(x, detail::FieldRule{"normal", -most, most});
  visit(p.ordinal);
  visit(p.missed, detail::FieldRule{"missed", 0.0, static_cast<double>(options.keep_steps)});
  visit(p.is_held, detail::FieldRule{"held", 0.0, 1.0});
}

}  // namespace

struct BRISTLE_PRIVATE ContactMatcher::Impl {
  /// A contact of this step (new), or an old contact: listed in the previous step, or missing for up to
  /// keep_steps steps. Contacts of one pair of bodies are linked in the order in which the caller listed
  /// them; old contacts that are missing follow the listed ones.
  struct Point {
    std::uint64_t pair = 0;
    double at[3] = {0.0, 0.0, 0.0};
    std::uint32_t index = 0;             ///< index of a new contact in the caller's list
    std::uint32_t ordinal = 0;           ///< number that tells the contact from other contacts of its pair
    std::uint32_t missed = 0;            ///< number of steps for which an old contact has been missing
    std::uint32_t is_held = 0;           ///< 1 for an old contact that was held in the step before
    double normal[3] = {0.0, 0.0, 0.0};  ///< zero: any
    std::uint32_t after = none;
    std::uint32_t partner = none;  ///< index of the contact matched to this one in the other of the two steps
    std::uint32_t nearest = none;  ///< index of the nearest unmatched contact in the other of the two steps
    double distance = 0.0;         ///< squared distance (m^2) to the contact `nearest`
    bool joined = false;           ///< whether a new contact has the number of one that is held

    bool agrees(const Point& other) const noexcept {
      const double cosine = dot(normal, other.normal);
      return cosine > least_cosine || (cosine == 0.0 && (has_any_normal() || other.has_any_normal()));
    }
    bool has_any_normal() const noexcept { return dot(normal, normal) == 0.0; }
    double squared_distance(const Point& other) const noexcept {
      const double d[3] = {at[0] - other.at[0], at[1] - other.at[1], at[2] - other.at[2]};
      return dot(d, d);
    }
    static double dot(const double (&a)[3], const double (&b)[3]) noexcept {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }
  };
  struct Pair {
    std::uint64_t pair;
    /// Indices of the first and the last contact of the pair of bodies, among the old contacts [0] and among
    /// the new ones [1].
    std::uint32_t first[2], last[2];
  };

  explicit Impl(const MatcherOptions& its_options)
      : options(its_options), reach_squared(options.reach * options.reach), table(0) {
    reserve();
  }

  /// Allocates room for the contacts of a step and for as many old contacts that are held or missing.
  void reserve() {
    table = KeyTable(3 * std::size_t{options.capacity});
    points[0].resize(2 * std::size_t{options.capacity});
    points[1].resize(2 * std::size_t{options.capacity});
    pairs.resize(3 * std::size_t{options.capacity});
    held.reserve(2 * std::size_t{options.capacity});
    joined.reserve(options.capacity);
  }

  void append(int side, std::uint32_t i) noexcept {
    Point& p = points[side][i];
    std::uint32_t k = table.find(p.pair);
    if (k == none) {
      k = pair_count++;
      BRISTLE_ASSERT(k < pairs.size());
      pairs[k] = {p.pair, {none, none}, {none, none}};
      table.insert(p.pair, k);
    }
    Pair& pair = pairs[k];
    (pair.last[side] == none ? pair.first[side] : points[side][pair.last[side]].after) = i;
    pair.last[side] = i;
  }

  /// Finds the nearest unmatched contact of the same two bodies in the other step, among those within reach.
  /// Of equally near ones takes the one listed first.
  void find_nearest(const Pair& pair, int side, Point& p) noexcept {
    p.nearest = none;
    p.distance = reach_squared;
    const std::vector<Point>& others = points[1 - side];
    for (std::uint32_t j = pair.first[1 - side]; j != none; j = others[j].after) {
      if (others[j].partner != none) continue;
      const double distance = p.squared_distance(others[j]);
      const bool nearer = distance < p.distance || (distance == p.distance && p.nearest == none);
      if (nearer && p.agrees(others[j])) {
        p.nearest = j;
        p.distance = distance;
      }
    }
  }

  /// Repeats the search for each unmatched contact whose nearest contact has meanwhile been matched to
  /// another.
  void look_again(const Pair& pair, int side) noexcept {
    for (std::uint32_t i = pair.first[side]; i != none; i = points[side][i].after) {
      Point& p = points[side][i];
      if (p.partner == none && p.nearest != none && points[1 - side][p.nearest].partner != none)
        find_nearest(pair, side, p);
    }
  }

  /// Matches the old and the new contacts of two bodies, shortest distance first, and returns the number of
  /// matches. Works in rounds: each round matches all pairs of contacts that are each other's nearest. The
  /// shortest distance left always belongs to such a pair, so every round makes progress.
  std::uint32_t match_pair(const Pair& pair) noexcept {
    std::uint32_t matched = 0;
    if (pair.first[0] == none || pair.first[1] == none) return 0;
    for (int side = 0; side < 2; ++side)
      for (std::uint32_t i = pair.first[side]; i != none; i = points[side][i].after)
        find_nearest(pair, side, points[side][i]);
    for (;;) {
      const std::uint32_t before_round = matched;
      for (std::uint32_t i = pair.first[1]; i != none; i = points[1][i].after) {
        Point& now = points[1][i];
        if (now.partner != none || now.nearest == none) continue;
        Point& before = points[0][now.nearest];
        if (before.partner != none || before.nearest != i) continue;
        BRISTLE_ASSERT(now.pair == before.pair && now.distance <= reach_squared);
        now.partner = now.nearest;
        before.partner = i;
        now.ordinal = before.ordinal;
        ++matched;
      }
      if (matched == before_round) break;
      look_again(pair, 0);
      look_again(pair, 1);
    }
    return matched;
  }

  bool is_taken(const Pair& pair, std::uint32_t ordinal) const noexcept {
    for (std::uint32_t i = pair.first[0]; i != none; i = points[0][i].after)
      if (points[0][i].ordinal == ordinal) return true;
    for (std::uint32_t i = pair.first[1]; i != none; i = points[1][i].after)
      if (points[1][i].partner != none && points[1][i].ordinal == ordinal) return true;
    return false;
  }

  /// Gives each unmatched new contact a number within its pair of bodies, the smallest that no contact of the
  /// pair has, new or old; the key follows from it. If its surfaces have `hold` contacts already, the new
  /// contact continues the nearest of them instead.
  void number_pair(const Pair& pair) noexcept {
    std::uint32_t ordinal = 0, added = 0;
    for (std::uint32_t i = pair.first[1]; i != none; i = points[1][i].after) {
      Point& p = points[1][i];
      if (p.partner != none || join(pair, p, added)) continue;
      while (is_taken(pair, ordinal)) ++ordinal;
      p.ordinal = ordinal++;
      ++added;
    }
  }
  bool join(const Pair& pair, Point& p, std::uint32_t added) noexcept {
    std::uint32_t count = added;
    const Point* nearest = nullptr;
    for (std::uint32_t j = pair.first[0]; j != none; j = points[0][j].after) {
      const Point& old = points[0][j];
      if (old.missed > 0 || !p.agrees(old)) continue;
      ++count;
      if (!nearest || p.squared_distance(old) < p.squared_distance(*nearest)) nearest = &old;
    }
    if (hold == 0 || !nearest || count < hold) return false;
    p.ordinal = nearest->ordinal;
    return p.joined = true;
  }
  /// Keeps old contacts that the caller did not list, as long as another contact of the same two surfaces is
  /// listed (set_hold).
  void hold_pair(const Pair& pair) noexcept {
    for (std::uint32_t j = pair.first[0]; j != none; j = points[0][j].after) {
      Point& old = points[0][j];
      old.is_held = 0;
      if (hold == 0 || old.partner != none || old.missed > 0) continue;
      for (std::uint32_t i = pair.first[1]; i != none && !old.is_held; i = points[1][i].after)
        old.is_held = points[1][i].agrees(old);
    }
  }

  /// Gives all contacts their keys of the step before, if the caller lists the same contacts in the same
  /// order and each has moved by less than a ten-thousandth of the reach. Returns false, and changes nothing,
  /// if not. Spares the search, which finds the same unless two contacts of a pair lie that near each other.
  bool repeat(Span<const ContactPoint> contacts, Span<std::uint64_t> keys,
              Span<const double> normals) noexcept {
    const std::size_t count = contacts.size();
    if (count != old_count || count != keys.size() || (!normals.empty() && normals.size() != 3 * count))
      return false;
    const auto fill_in = [&](Point& p, std::size_t i) {
      std::copy_n(contacts[i].point, 3, p.at);
      std::fill_n(p.normal, 3, 0.0);
      if (!normals.empty()) std::copy_n(&normals[3 * i], 3, p.normal);
    };
    for (std::size_t i = 0; i < count; ++i) {
      const Point& old = points[0][i];
      Point now;
      fill_in(now, i);
      if (contacts[i].pair != old.pair || old.missed > 0 || old.is_held > 0 ||
          !(now.squared_distance(old) < 1e-8 * reach_squared) || !now.agrees(old))
        return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
      fill_in(points[0][i], i);
      keys[i] = key_of(contacts[i].pair, points[0][i].ordinal);
    }
    held.clear();
    joined.clear();
    return true;
  }

  MatcherOptions options;
  std::uint32_t hold = 0;
  const double reach_squared;
  KeyTable table;  ///< index in `pairs` of each pair of bodies; empty between steps
  std::vector<Point> points[2];
  std::vector<Pair> pairs;
  std::vector<HeldContact> held;
  /// Indices, ascending, of those contacts in the caller's last list that got the key of another contact of
  /// their surfaces (has_joined).
  std::vector<std::uint32_t> joined;
  std::uint32_t old_count = 0;
  std::uint32_t pair_count = 0;
};

ContactMatcher::ContactMatcher(const MatcherOptions& options) {
  detail::require_fields("MatcherOptions", options);
  impl_ = std::make_unique<Impl>(options);
}
ContactMatcher::~ContactMatcher() = default;
ContactMatcher::ContactMatcher(ContactMatcher&&) noexcept = default;
ContactMatcher& ContactMatcher::operator=(ContactMatcher&&) noexcept = default;

void ContactMatcher::reserve(std::uint32_t contacts) {
  if (contacts <= impl_->options.capacity) return;
  detail::require_fields("MatcherOptions", MatcherOptions{}.with_capacity(contacts));
  impl_->options.capacity = contacts;
  impl_->reserve();
}
std::uint32_t ContactMatcher::capacity() const noexcept { return impl_->options.capacity; }

std::size_t ContactMatcher::match(Span<const ContactPoint> contacts, Span<std::uint64_t> keys,
                                  Span<const double> normals) noexcept {
  Impl& impl = *impl_;
  if (impl.repeat(contacts, keys, normals)) return contacts.size();
  std::vector<Impl::Point>&before = impl.points[0], &now = impl.points[1];
  for (std::uint32_t i = 0; i < impl.old_count; ++i) {
    before[i].after = before[i].partner = none;
    impl.append(0, i);
  }
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    keys[i] = no_contact_key;
    if (i >= contacts.size() || count == impl.options.capacity) continue;
    const ContactPoint& c = contacts[i];
    if (!std::isfinite(c.point[0]) || !std::isfinite(c.point[1]) || !std::isfinite(c.point[2])) continue;
    Impl::Point& p = now[count];
    p = Impl::Point{};
    p.pair = c.pair;
    std::copy_n(c.point, 3, p.at);
    if (3 * i + 3 <= normals.size()) std::copy_n(&normals[3 * i], 3, p.normal);
    p.index = static_cast<std::uint32_t>(i);
    impl.append(1, count++);
  }

  std::size_t matched = 0;
  for (std::uint32_t k = 0; k < impl.pair_count; ++k) {
    matched += impl.match_pair(impl.pairs[k]);
    impl.number_pair(impl.pairs[k]);
    impl.hold_pair(impl.pairs[k]);
    impl.table.erase(impl.pairs[k].pair);
  }
  std::uint32_t own = 0;
  impl.joined.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    keys[now[i].index] = key_of(now[i].pair, now[i].ordinal);
    if (now[i].joined)
      impl.joined.push_back(now[i].index);
    else
      now[own++] = now[i];
  }
  count = own;

  impl.held.clear();
  const std::uint32_t room = static_cast<std::uint32_t>(now.size());
  for (std::uint32_t i = 0; i < impl.old_count && count < room; ++i) {
    Impl::Point& old = before[i];
    if (old.partner != none) continue;
    if (old.is_held)
      impl.held.push_back({key_of(old.pair, old.ordinal), {old.pair, {old.at[0], old.at[1], old.at[2]}}});
    else if (old.missed++ >= impl.options.keep_steps)
      continue;
    now[count++] = old;
  }
  BRISTLE_ASSERT(matched <= impl.old_count && matched <= contacts.size());
  before.swap(now);
  impl.old_count = count;
  impl.pair_count = 0;
  return matched;
}

bool ContactMatcher::has_joined(std::size_t i) const noexcept {
  return std::binary_search(impl_->joined.begin(), impl_->joined.end(), i);
}
void ContactMatcher::set_hold(std::uint32_t contacts) noexcept { impl_->hold = contacts; }
Span<const HeldContact> ContactMatcher::held() const noexcept { return impl_->held; }

bool ContactMatcher::release(std::uint64_t key) noexcept {
  auto& points = impl_->points[0];
  for (std::uint32_t i = 0; i < impl_->old_count; ++i) {
    if (!points[i].is_held || key_of(points[i].pair, points[i].ordinal) != key) continue;
    for (--impl_->old_count; i < impl_->old_count; ++i) points[i] = points[i + 1];
    return true;
  }
  return false;
}

void ContactMatcher::clear() noexcept {
  impl_->old_count = 0;
  impl_->held.clear();
}

std::size_t ContactMatcher::state_size() const noexcept {
  return detail::saved_head_size + impl_->old_count * saved_point;
}

std::size_t ContactMatcher::save_state(Span<std::byte> to) const noexcept {
  if (to.size() < state_size()) return 0;
  detail::ByteWriter write(to.data() + detail::saved_head_size);
  for (std::uint32_t i = 0; i < impl_->old_count; ++i) {
    const Impl::Point& p = impl_->points[0][i];
    point_fields(p, impl_->options, write);
  }
  detail::seal(detail::SavedKind::points, impl_->old_count, {to.data(), state_size()});
  return state_size();
}

void ContactMatcher::restore_state(Span<const std::byte> from) {
  const auto fail = [](const char* why) { detail::refuse_saved("ContactMatcher", why); };
  const std::uint64_t count = detail::open_sealed("ContactMatcher", detail::SavedKind::points, from);
  if (count > impl_->points[0].size()) fail("has more contacts than this matcher remembers");
  if (from.size() != detail::saved_head_size + count * saved_point)
    fail("has another length than its contacts");
  detail::ByteReader read(from.data() + detail::saved_head_size);
  std::vector<Impl::Point> points(impl_->points[0].size());
  KeyTable keys(count);
  for (std::size_t i = 0; i < count; ++i) {
    Impl::Point& p = points[i];
    detail::FieldCheck check{read};
    point_fields(p, impl_->options, check);
    if (check.fault != nullptr) fail("has a value that no contact can have");
    const std::uint64_t key = key_of(p.pair, p.ordinal);
    if (keys.find(key) != none) fail("has two contacts of one key");
    keys.insert(key, static_cast<std::uint32_t>(i));
  }
  impl_->held.clear();
  impl_->joined.clear();
  impl_->points[0].swap(points);
  impl_->old_count = static_cast<std::uint32_t>(count);
}

}  // namespace bristle
