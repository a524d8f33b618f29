// The contract of every kind of object: same bits on every instruction set, number of threads and in any
// company; a trial answers as the step and leaves no trace; a saved state goes on with the same bits; a
// damaged one, and bad input, are refused and change nothing; a reset object is a new one; a group answers as
// its patches do. Every output is compared.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "contract_kinds.hpp"

namespace bristle_test::test_contract {

using namespace contract;

namespace {

/// Checks that two answers have the same status and bits, and reports the first output that differs.
void check_same(const Answers& expected, const Answers& got, const std::string& what) {
  if (expected.size() != got.size()) FAIL_CHECK(what << ": another number of members");
  int shown = 0;
  for (std::size_t m = 0; m < got.size() && shown < 5; ++m) {
    if (expected[m] == got[m]) continue;
    ++shown;
    std::size_t at = 0;
    while (at < got[m].bits.size() && expected[m].bits[at] == got[m].bits[at]) ++at;
    FAIL_CHECK(what << ": member " << m << ", output " << at << " of " << got[m].bits.size() << ": "
                    << (at < got[m].bits.size() ? std::bit_cast<double>(got[m].bits[at]) : 0.0) << " for "
                    << (at < got[m].bits.size() ? std::bit_cast<double>(expected[m].bits[at]) : 0.0));
  }
}
/// Checks that the first `count` members of two objects have the same state.
void check_same_states(const Subject& expected, const Subject& got, std::size_t count,
                       const std::string& what) {
  for (std::size_t m = 0; m < count; ++m)
    if (expected.hash(m) != got.hash(m)) FAIL_CHECK(what << ": member " << m << " has another state");
}

constexpr int changing = 10;  ///< step before which members get another material

/// Does step k, with the change of material that comes before it.
Answers go(Subject& subject, int k) {
  if (k == changing) subject.change();
  return subject.step(k);
}

std::string at_step(const Kind& kind, int k) { return kind.name + ", step " + std::to_string(k); }

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("Every kind has the same bits on every instruction set, in any company, lazy and eager",
          "[contract][determinism]") {
  for (const Kind& kind : all_kinds_and_variants()) {
    const auto expected = kind.make({BatchOptions{}.with_isa("scalar")});
    std::vector<std::pair<std::string, std::unique_ptr<Subject>>> others;
    others.emplace_back("eager", kind.make({{}, 0, true}));
    for (const bristle::IsaInfo& isa : bristle::instruction_sets())
      if (isa.usable) others.emplace_back(isa.name, kind.make({BatchOptions{}.with_isa(isa.name), 29}));
    for (int k = 0; k < 30; ++k) {
      const Answers answers = go(*expected, k);
      for (auto& [how, subject] : others) {
        const std::string what = how + ", " + at_step(kind, k);
        check_same(answers, go(*subject, k), what);
        if (k % 10 == 9) check_same_states(*expected, *subject, answers.size(), what);
      }
    }
  }
  for (const bristle::IsaInfo& isa : bristle::instruction_sets())
    if (!isa.usable) std::printf("skipped: this machine does not run %s\n", isa.name);
}

namespace {

/// Lets threads share the steps of batches that are made while it lives, small ones too, in small pieces.
struct SmallPieces {
  SmallPieces() { set("BRISTLE_SHARING=0,256,100"); }
  ~SmallPieces() { set("BRISTLE_SHARING="); }
  static void set(const char* text) {
#if defined(_WIN32)
    _putenv(text);
#else
    putenv(const_cast<char*>(text));
#endif
  }
};

}  // namespace

TEST_CASE("Every kind has the same bits with any number of threads", "[contract][determinism][threads]") {
  for (const Kind& kind : all_kinds_and_variants(true)) {
    std::vector<Answers> expected;
    std::vector<std::uint64_t> states;
    for (const int threads : {1, 3, 8}) {
      const auto subject = [&] {
        const SmallPieces pieces;
        return kind.make({BatchOptions{}.with_threads(threads), threads == 1 ? std::size_t{0} : 150});
      }();
      const std::string what = kind.name + ", " + std::to_string(threads) + " threads";
      std::vector<Answers> seen;
      for (int k = 5; k < 18; ++k) seen.push_back(go(*subject, k));
      const Spoilt bad{seen[0].size() - 1, 1, nan};
      seen.push_back(subject->step(18, &bad));
      seen.push_back(subject->step_crowd(19));
      if (threads == 1) expected = seen;
      for (std::size_t i = 0; i < seen.size(); ++i)
        check_same(expected[i], seen[i], what + ", step " + std::to_string(i + 5));
      for (std::size_t m = 0; m < expected[0].size(); ++m)
        if (threads == 1)
          states.push_back(subject->hash(m));
        else if (states[m] != subject->hash(m))
          FAIL_CHECK(what << ": member " << m << " has another state");
      if (BRISTLE_WITH_TBB != 0 && threads > 1 && subject->most_tasks < 2)
        FAIL_CHECK(what << " share no step");
    }
  }
}

TEST_CASE("A group answers as patches of its seeds and keys that were added one by one",
          "[contract][group]") {
  for (const Kind& kind : all_kinds()) {
    if (!kind.one_by_one) continue;
    for (const std::size_t company : {0, 29}) {
      const How how{{}, company};
      const auto group = kind.make(how), patches = kind.one_by_one(how);
      for (int k = 0; k < 40; ++k) {
        const Answers trial = group->find(k), expected = go(*patches, k);
        if (k != changing) check_same(expected, trial, "trial: " + at_step(kind, k));
        check_same(expected, go(*group, k), at_step(kind, k));
        check_same_states(*patches, *group, few, at_step(kind, k));
        expect(group->report.status == patches->report.status, "status of the step");
        expect(group->report.patches_stepped == patches->report.patches_stepped, "patches of the step");
        if (company == 0)
          expect(group->report.bristles_visited == patches->report.bristles_visited, "visits of the step");
      }
    }
  }
}

TEST_CASE("Objects of every kind have the same bits in C", "[contract][c]") {
  for (const Kind& kind : all_kinds_and_variants()) {
    if (!kind.in_c) continue;
    const auto expected = kind.make({{}, 5}), got = kind.in_c({{}, 5});
    for (int k = 0; k < 30; ++k) {
      if (k == 20) {
        const std::vector<std::byte> saved = expected->save();
        expect(got->save() == saved, (kind.name + ": saved state").c_str());
        got->restore(saved);
      }
      check_same(expected->find(k), got->find(k), "trial: " + at_step(kind, k));
      check_same(go(*expected, k), go(*got, k), at_step(kind, k));
      expect(got->report.patches_stepped == expected->report.patches_stepped, "patches of the step");
    }
    expect(got->hash() == expected->hash(), kind.name.c_str());
    if (!got->can_reset()) continue;
    for (const bool reseeded : {false, true}) {
      for (Subject* subject : {expected.get(), got.get()})
        reseeded ? subject->reset_as(9) : (subject->reset(), true);
      expect(got->save() == expected->save(), (kind.name + ", reset").c_str());
    }
  }
}

TEST_CASE("A trial of every kind answers as the step and leaves no trace", "[contract]") {
  for (const Kind& kind : all_kinds_and_variants()) {
    const auto tried = kind.make({}), untried = kind.make({});
    for (int k = 0; k < 25; ++k) {
      if (k == changing)
        for (Subject* subject : {tried.get(), untried.get()}) subject->change();
      if (k == 15)
        for (Subject* subject : {tried.get(), untried.get()}) subject->reset();
      const auto saved = tried->save();
      tried->find(k + 17);
      if (k % 4 == 3) tried->restore(saved);  // forgets what the last trial prepared
      const Answers trial = tried->find(k);
      expect(tried->save() == saved, at_step(kind, k).c_str());
      check_same(tried->step(k), trial, "trial: " + at_step(kind, k));
      check_same(untried->step(k), trial, "without trials: " + at_step(kind, k));
      expect(tried->hash() == untried->hash(), at_step(kind, k).c_str());
    }
  }
}

TEST_CASE("A saved state of every kind goes on with the same bits, anywhere", "[contract][state]") {
  for (const Kind& kind : all_kinds_and_variants())
    for (const int half : {7, 20}) {
      const auto first = kind.make({BatchOptions{}.with_threads(2)});
      const auto second = kind.make({BatchOptions{}.with_isa("scalar")});
      const std::size_t size = first->save().size();
      for (int k = 0; k < half; ++k) go(*first, k);
      for (int k = 0; k < 3; ++k) second->step(3 * k + 1);  // must leave no trace
      if (half > changing) second->change();
      const std::vector<std::byte> saved = first->save();
      expect(half > changing || saved.size() == size,
             (kind.name + ": the size of a state depends on it").c_str());
      std::vector<std::byte> small(saved.size() - 1);
      expect(first->save(small) == 0, "a state that does not fit is not written");
      second->restore(saved);
      expect(second->save() == saved, (kind.name + ": saved again").c_str());
      expect(second->hash() == first->hash(), kind.name.c_str());
      for (int k = half; k < half + 15; ++k)
        check_same(go(*first, k), go(*second, k), "restored: " + at_step(kind, k));
      expect(second->save() == first->save(), (kind.name + ": saved at the end").c_str());
      if (half <= changing) continue;
      first->restore(saved);
      expect(first->save() == saved, (kind.name + ": restored again").c_str());
    }
}

TEST_CASE(
    "A state of every kind that is damaged, cut short or of another kind is refused and changes nothing",
    "[contract][state]") {
  const std::vector<Kind> kinds = all_kinds();
  std::vector<std::byte> of_another = kinds.back().make({{}, 1})->save();
  for (const Kind& kind : kinds) {
    const auto subject = kind.make({}), untouched = kind.make({});
    for (int k = 0; k < 10; ++k) {
      subject->step(k);
      untouched->step(k);
    }
    const std::vector<std::byte> saved = subject->save();
    const auto refused = [&](const std::vector<std::byte>& state, const char* what) {
      const std::string message = message_of([&] { subject->restore(state); });
      if (message == "(no error)") FAIL_CHECK(kind.name << ": a state " << what << " was restored");
    };
    const std::size_t stride = std::max<std::size_t>(1, saved.size() / 200);
    for (std::size_t at = 0; at < saved.size(); at += at < 100 ? 1 : stride) {
      std::vector<std::byte> damaged = saved;
      damaged[at] ^= std::byte{4};
      refused(damaged, "with a bit turned");
      damaged.resize(at);
      refused(damaged, "that is cut short");
    }
    std::vector<std::byte> longer = saved;
    longer.push_back(std::byte{0});
    refused(longer, "with a byte behind it");
    refused(of_another, "of another kind");
    of_another = kind.make({{}, 1})->save();
    refused(of_another, "of more members");
    expect(subject->save() == saved, kind.name.c_str());
    check_same(untouched->step(10), subject->step(10), "after refusals: " + at_step(kind, 10));
  }
}

namespace {

/// Forges numbers of a saved state. Every number of every kind of object begins at a multiple of 4 bytes.
class Forger {
 public:
  explicit Forger(const std::vector<std::byte>& good) : good_(good), forged_(good) {}

  /// Calls `visit(forged, what)` for states with one number forged: the numbers of the first 300 bytes, then
  /// as many others as given. Each takes one forgery of `every`; `kind` and its place choose the first.
  template <class Visit>
  void each_number(std::size_t others, std::size_t kind, std::size_t every, Visit&& visit) {
    const std::size_t stride = 4 * std::max<std::size_t>(1, good_.size() / 4 / others);
    for (std::size_t at = 8; at + 8 <= good_.size(); at += at < 300 ? 4 : stride)
      for (std::size_t forgery = (kind + at / 4) % every; forgery < forgeries; forgery += every) {
        forge(at, forgery);
        if (forged_ != good_) visit(forged_, what_);  // some forgeries leave zero as it is
        undo();
      }
  }
  /// Calls `visit(forged, what)` for states with several numbers forged: two to four anywhere, or a run of up
  /// to sixty by one forgery, as of a column.
  template <class Visit>
  void several(std::size_t count, Visit&& visit) {
    for (std::size_t k = 0; k < count; ++k) {
      const bool run = k % 2 == 0;
      std::size_t at = any_offset(), forgery = random_() % forgeries;
      for (std::size_t left = 2 + random_() % (run ? 59 : 3); left > 0; --left) {
        forge(at, forgery);
        at = run ? std::min(at + (forgery < wide_forgeries ? 8 : 4), good_.size() - 8) : any_offset();
        if (!run) forgery = random_() % forgeries;
      }
      visit(forged_, what_);
      undo();
    }
  }

 private:
  static constexpr std::size_t wide_forgeries = 16, forgeries = wide_forgeries + 10;

  void forge(std::size_t at, std::size_t forgery) {
    const auto x = number_at<double>(at);
    const double wide[] = {nan, infinity, -infinity, -x, -1e-301, -1.0, 2.0 * x, 1e6 * x, 1e300, 0.0};
    constexpr std::uint64_t one = 1, words[] = {one << 63, one << 62, (one << 60) - 1, ~(one << 63),
                                                0x7e37'e43c'7e37'e43c};  // near the largest numbers
    const auto y = number_at<float>(at);
    const auto narrow_nan = static_cast<float>(nan), narrow_infinity = static_cast<float>(infinity);
    const float narrow[] = {narrow_nan, narrow_infinity, -y, 4.0f * y, 1e30f, 0.0f};
    if (forgery < std::size(wide))
      put(at, wide[forgery]);
    else if (forgery - std::size(wide) < std::size(words))
      put(at, words[forgery - std::size(wide)]);
    else if (forgery < wide_forgeries)
      put(at, number_at<std::uint64_t>(any_offset()));
    else if (forgery - wide_forgeries < std::size(narrow))
      put(at, narrow[forgery - wide_forgeries]);
    else
      put(at, forgery % 4 == 2   ? ~0u
              : forgery % 4 == 3 ? number_at<std::uint32_t>(any_offset())
              : forgery % 4 == 0 ? 0x7fffffffu
                                 : number_at<std::uint32_t>(at) + 1);
    what_ += " byte " + std::to_string(at) + " forgery " + std::to_string(forgery);
  }
  void undo() {
    forged_ = good_;
    what_.clear();
  }
  std::size_t any_offset() { return 8 + 4 * (random_() % ((good_.size() - 16) / 4)); }
  template <class T>
  T number_at(std::size_t at) const {
    T value;
    std::memcpy(&value, good_.data() + at, sizeof value);
    return value;
  }
  template <class T>
  void put(std::size_t at, const T& value) {
    std::memcpy(forged_.data() + at, &value, sizeof value);
  }

  const std::vector<std::byte> good_;
  std::vector<std::byte> forged_;
  std::string what_;
  std::mt19937_64 random_{7};
};

/// Returns what is wrong with answers: a number that is not finite, or a force far above its limit.
std::string find_harm(const Answers& answers) {
  for (const Answer& answer : answers) {
    for (std::size_t i = 0; i < answer.bits.size(); ++i)
      if (!std::isfinite(std::bit_cast<double>(answer.bits[i])))
        return "output " + std::to_string(i) + " is not finite";
    // Forged random states may give every bristle the longest length of its law, forged ages the strength of
    // the oldest.
    if (!(answer.excess <= 10.0)) return "a force of " + std::to_string(answer.excess) + " limits";
  }
  return {};
}

/// Forges saved states of every kind with true checksums: each is refused, or the object that took it
/// answers a rest, a trial and steps by finite forces below their limits, and takes its own state again.
/// `others`, `every`, `several`: as in Forger.
void forge_states(const std::vector<int>& lengths, std::size_t others, std::size_t every,
                  std::size_t several) {
  std::size_t states = 0, refused = 0, kinds = 0;
  for (const Kind& kind : all_kinds()) {
    ++kinds;
    const auto subject = kind.make({});
    const Spoilt unloaded{1, 0, 0.0};
    int reported = 0;
    for (const int steps : lengths) {
      for (int k = 0; k < steps; ++k) subject->step(k);
      subject->step(steps, &unloaded);  // takes the middle member out of contact
      Forger forger(subject->save());
      const auto judge = [&](std::vector<std::byte> forged, const std::string& what) {
        ++states;
        subject->seal(forged);
        if (message_of([&] { subject->restore(forged); }) != "(no error)") {
          ++refused;
          return;
        }
        std::string harm = find_harm(subject->step(steps + 1, &unloaded));
        if (harm.empty()) harm = find_harm(subject->find(steps + 2));
        for (int k = steps + 2; harm.empty() && k < steps + 4; ++k) harm = find_harm(subject->step(k));
        if (harm.empty()) harm = message_of([&] { subject->restore(subject->save()); });
        if (harm == "(no error)") harm.clear();
        if (!harm.empty() && ++reported <= 10) FAIL_CHECK(kind.name << "," << what << ": " << harm);
      };
      const std::vector<std::byte> good = subject->save();
      forger.each_number(others, kinds, every, judge);
      forger.several(several, judge);
      subject->restore(good);
    }
  }
  INFO(states << " forged states, " << refused << " refused");
  CHECK(refused > states / 4);
}

}  // namespace

TEST_CASE("A state of every kind with forged numbers and a true checksum is refused or does no harm",
          "[contract][state][hostile]") {
  forge_states({7}, 20, 3, 200);
}

// Forges numbers at every place. Runs on request only, because it takes minutes.
TEST_CASE("A state of every kind that is forged anywhere is refused or does no harm", "[.forged]") {
  forge_states({7, 4}, 1000, 1, 20000);
}

TEST_CASE("A bad number in a motion of every kind is flagged, answered by zeros, and changes nothing",
          "[contract][bad-input]") {
  for (const Kind& kind : all_kinds()) {
    const int numbers = kind.make({})->numbers();
    for (int number = 0; number < numbers; ++number)
      for (const double by : kind.make({})->bad_values(number)) {
        const auto spoilt = kind.make({}), good = kind.make({});
        for (int k = 0; k < 5; ++k) {
          spoilt->step(k);
          good->step(k);
        }
        const Spoilt bad{1, number, by}, unnamed{1, -1, 0.0};
        const std::string what = kind.name + ", number " + std::to_string(number);
        const auto refused = [&](const Answer& answer) {
          expect(answer.status == Status::bad_input, (what + ": flagged").c_str());
          expect(std::all_of(answer.bits.begin(), answer.bits.end(), [](std::uint64_t b) { return b == 0; }),
                 (what + ": answered by zeros").c_str());
        };
        refused(spoilt->find(5, &bad)[1]);
        Answers expected = good->step(5, &unnamed), got = spoilt->step(5, &bad);
        refused(got[1]);
        expect(has(spoilt->report.status, Status::bad_input), (what + ": reported").c_str());
        expect(spoilt->report.patches_stepped == few - 1, (what + ": the others are stepped").c_str());
        expect(spoilt->hash() == good->hash(), (what + ": a member without a motion").c_str());
        got[1] = expected[1];
        check_same(expected, got, "neighbours of a bad motion: " + what);
        check_same(good->step(6), spoilt->step(6), "after a bad motion: " + what);
      }
  }
}

TEST_CASE("A step of every kind names its ids, times and lengths that are wrong, and steps the rest",
          "[contract][bad-input]") {
  for (const Kind& kind : all_kinds()) {
    INFO(kind.name);
    const auto wrong = kind.make({}), good = kind.make({});
    for (int k = 0; k < 5; ++k) {
      wrong->step(k);
      good->step(k);
    }
    std::uint64_t before = wrong->hash();
    const auto check_refused = [](const Answer& answer, Status why) {
      CHECK(answer.status == why);
      CHECK(std::all_of(answer.bits.begin(), answer.bits.end(), [](std::uint64_t b) { return b == 0; }));
    };
    const auto check_all_refused = [&](const Answers& answers) {
      for (const Answer& answer : answers) check_refused(answer, Status::bad_input);
      CHECK(wrong->report.status == Status::bad_input);
      CHECK(wrong->report.patches_stepped == 0);
      CHECK(wrong->hash() == before);
    };
    // A denormal time step counts as 0, because whether it differs from 0 would depend on the caller's
    // floating-point mode.
    const double denormal = std::numeric_limits<double>::denorm_min();
    if (wrong->has_time())
      for (const double dt : {0.0, -0.0, -1e-3, nan, infinity, -infinity, denormal, 2e-308}) {
        wrong->dt = dt;
        check_all_refused(wrong->step(5));
        for (const Answer& answer : wrong->find(5)) check_refused(answer, Status::bad_input);
      }
    wrong->dt = tick;
    const Answers crowd = wrong->step_crowd(5);
    if (crowd.empty()) continue;
    CHECK(has(wrong->report.status, Status::unknown_id));
    CHECK(has(wrong->report.status, Status::repeated_id));
    CHECK(wrong->report.patches_stepped == few);
    const Answers expected = good->step(5);
    check_same(expected, {crowd.begin() + 1, crowd.begin() + 1 + few}, "among ids that are none");
    for (const std::size_t none : {std::size_t{0}, few + 2, few + 3})
      check_refused(crowd[none], Status::unknown_id);
    check_refused(crowd[few + 1], Status::repeated_id);
    before = wrong->hash();
    for (const std::size_t count : {std::size_t{0}, few - 1, few + 1})
      check_all_refused(wrong->step_into(6, count));
    check_same(good->step(6), wrong->step(6), "after wrong steps");
    check_same_states(*good, *wrong, few, kind.name);
  }
}

TEST_CASE("An object of every kind that was reset is a new one, of the seed and key that it was given",
          "[contract]") {
  for (const Kind& kind : all_kinds_and_variants())
    for (const std::uint32_t reseed : {0u, 1000u}) {
      const auto used = kind.make({}), fresh = kind.make({{}, 0, false, reseed});
      std::size_t count = 0;
      for (int k = 0; k < 15; ++k) count = used->step(k).size();
      if (reseed == 0)
        used->reset();
      else if (!used->reset_as(reseed))
        continue;
      const std::string what = kind.name + ", reset with " + std::to_string(reseed);
      check_same_states(*fresh, *used, count, what);
      for (int k = 15; k < 30; ++k) check_same(fresh->step(k), used->step(k), "reset: " + at_step(kind, k));
      for (Subject* subject : {fresh.get(), used.get()}) subject->change();
      const std::vector<std::byte> saved = used->save();
      const Answers expected = fresh->step(30);
      check_same(expected, used->step(30), what + ", of another material");
      used->reset_as(5);
      used->restore(saved);
      check_same(expected, used->step(30), what + ", restored over another seed");
      for (Subject* subject : {fresh.get(), used.get()}) subject->reset();
      check_same_states(*fresh, *used, count, what + ", restored and reset");
    }
}

TEST_CASE("Columns of bristles are written as far as the columns and the bristles reach", "[contract]") {
  const PatchOptions twenty = plain_options(20), infinite = infinite_options(8.0);
  for (const auto& [rule, options] : {std::pair{SnapRule::redraw, twenty}, std::pair{SnapRule::slide, twenty},
                                      std::pair{SnapRule::redraw, infinite}}) {
    OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule), options);
    patch.step(0.3 * dbar, 0.1 * dbar, options.max_normal_load);
    for (const std::size_t asked : {std::size_t{7}, std::size_t{20}, std::size_t{30}}) {
      std::vector<double> x(40, -1.0), y = x, delta = x;
      const std::size_t got =
          patch.batch.read_bristles(patch.id, {x.data(), asked}, {y.data(), asked}, {delta.data(), asked});
      CHECK(got ==
            (options.population == bristle::Population::infinite ? asked : std::min<std::size_t>(asked, 20)));
      for (const std::vector<double>& column : {x, y, delta}) {
        CHECK(static_cast<std::size_t>(std::count(column.begin(), column.end(), -1.0)) == 40 - got);
        CHECK(column[got - 1] != -1.0);
      }
    }
  }
}

}  // namespace bristle_test::test_contract
