// The contract of every kind of object: same bits on every instruction set, number of threads and in any
// company; a trial answers as the step and leaves no trace; a saved state goes on with the same bits; a
// damaged one, and bad input, are refused and change nothing; a reset object is a new one. Every output is
// compared.
#include <cstdlib>
#include <cstring>

#include "contract_kinds.hpp"

namespace bristle_test::test_contract {

using namespace contract;

namespace {

/// Checks that two answers have the same status and bits, and reports the first output that differs.
void check_same(const Answers& expected, const Answers& got, const std::string& what) {
  for (std::size_t m = 0; m < members; ++m) {
    if (expected[m] == got[m]) continue;
    std::size_t at = 0;
    while (at < got[m].bits.size() && expected[m].bits[at] == got[m].bits[at]) ++at;
    FAIL_CHECK(what << ": member " << m << ", output " << at << " of " << got[m].bits.size() << ": "
                    << (at < got[m].bits.size() ? std::bit_cast<double>(got[m].bits[at]) : 0.0) << " for "
                    << (at < got[m].bits.size() ? std::bit_cast<double>(expected[m].bits[at]) : 0.0));
  }
}

std::string at_step(const Kind& kind, int k) { return kind.name + ", step " + std::to_string(k); }

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("Every kind has the same bits on every instruction set and in any company",
          "[contract][determinism]") {
  for (const Kind& kind : all_kinds()) {
    const auto expected = kind.make(BatchOptions{}.with_isa("scalar"), 0);
    std::vector<std::pair<std::string, std::unique_ptr<Subject>>> others;
    for (const bristle::IsaInfo& isa : bristle::instruction_sets())
      if (isa.usable)
        others.emplace_back(isa.name, kind.make(BatchOptions{}.with_isa(isa.name), 20 + others.size()));
    for (int k = 0; k < 40; ++k) {
      const Answers answers = expected->step(k);
      for (auto& [isa, subject] : others) {
        check_same(answers, subject->step(k), isa + ", " + at_step(kind, k));
        for (std::size_t m = 0; m < members; ++m)
          if (subject->hash(m) != expected->hash(m))
            FAIL_CHECK(isa << ", " << at_step(kind, k) << ": another hash");
      }
    }
  }
}

TEST_CASE("Every kind has the same bits with any number of threads", "[contract][determinism][threads]") {
  for (const Kind& kind : all_kinds()) {
    setenv("BRISTLE_SHARING", "0,4096,100", 1);  // shares small steps too, also after a pause
    const auto one = kind.make({}, 0), many = kind.make(BatchOptions{}.with_threads(3), 3000);
    unsetenv("BRISTLE_SHARING");
    for (int k = 0; k < 5; ++k) {
      check_same(one->step(k), many->step(k), "3 threads, " + at_step(kind, k));
      for (std::size_t m = 0; m < members; ++m) expect(one->hash(m) == many->hash(m), kind.name.c_str());
    }
    if (BRISTLE_WITH_TBB != 0 && many->most_tasks < 2) FAIL_CHECK(kind.name << ": threads share no step");
  }
}

TEST_CASE("A trial of every kind answers as the step and leaves no trace", "[contract]") {
  for (const Kind& kind : all_kinds()) {
    const auto tried = kind.make({}, 0), untried = kind.make({}, 0);
    for (int k = 0; k < 40; ++k) {
      const auto saved = tried->save();
      tried->find(k + 17);
      const Answers trial = tried->find(k);
      expect(tried->save() == saved, at_step(kind, k).c_str());
      check_same(tried->step(k), trial, "trial: " + at_step(kind, k));
      check_same(untried->step(k), trial, "without trials: " + at_step(kind, k));
      expect(tried->hash() == untried->hash(), at_step(kind, k).c_str());
    }
  }
}

TEST_CASE("A saved state of every kind goes on with the same bits, anywhere", "[contract][state]") {
  for (const Kind& kind : all_kinds())
    for (const int half : {0, 1, 7, 20}) {
      const auto first = kind.make(BatchOptions{}.with_threads(2), 0);
      const auto second = kind.make(BatchOptions{}.with_isa("scalar"), 0);
      for (int k = 0; k < half; ++k) first->step(k);
      for (int k = 0; k < 5; ++k) second->step(3 * k + 1);  // must leave no trace
      const std::vector<std::byte> saved = first->save();
      std::vector<std::byte> small(saved.size() - 1);
      expect(first->save(small) == 0, "a state that does not fit is not written");
      second->restore(saved);
      expect(second->save() == saved, (kind.name + ": saved again").c_str());
      expect(second->hash() == first->hash(), kind.name.c_str());
      for (int k = half; k < half + 20; ++k)
        check_same(first->step(k), second->step(k), "restored: " + at_step(kind, k));
      expect(second->hash() == first->hash(), kind.name.c_str());
    }
}

TEST_CASE(
    "A state of every kind that is damaged, cut short or of another kind is refused and changes nothing",
    "[contract][state]") {
  const std::vector<Kind> kinds = all_kinds();
  std::vector<std::byte> of_another = kinds.back().make({}, 1)->save();
  for (const Kind& kind : kinds) {
    const auto subject = kind.make({}, 0), untouched = kind.make({}, 0);
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
    for (std::size_t at = 0; at < saved.size(); at += stride) {
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
    of_another = kind.make({}, 1)->save();
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

  /// Calls `visit(forged, what)` for states with one number forged in every way: the numbers of the first 300
  /// bytes, then as many others as given.
  template <class Visit>
  void each_number(std::size_t others, Visit&& visit) {
    const std::size_t stride = 4 * std::max<std::size_t>(1, good_.size() / 4 / others);
    for (std::size_t at = 8; at + 8 <= good_.size(); at += at < 300 ? 4 : stride)
      for (std::size_t way = 0; way < ways; ++way) {
        forge(at, way);
        visit(forged_, what_);
        undo();
      }
  }
  /// Calls `visit(forged, what)` for states with several numbers forged: two to four anywhere, or a run of up
  /// to sixty in one way, as of a column.
  template <class Visit>
  void several(std::size_t count, Visit&& visit) {
    for (std::size_t k = 0; k < count; ++k) {
      const bool run = k % 2 == 0;
      std::size_t at = any_place(), way = random_() % ways;
      for (std::size_t left = 2 + random_() % (run ? 59 : 3); left > 0; --left) {
        forge(at, way);
        at = run ? std::min(at + (way < wide_ways ? 8 : 4), good_.size() - 8) : any_place();
        if (!run) way = random_() % ways;
      }
      visit(forged_, what_);
      undo();
    }
  }

 private:
  static constexpr std::size_t wide_ways = 16, ways = wide_ways + 10;

  void forge(std::size_t at, std::size_t way) {
    const auto x = number_at<double>(at);
    const double wide[] = {nan, infinity, -infinity, -x, -1e-301, -1.0, 2.0 * x, 1e6 * x, 1e300, 0.0};
    constexpr std::uint64_t one = 1, words[] = {one << 63, one << 62, (one << 60) - 1, ~(one << 63),
                                                0x7e37'e43c'7e37'e43c};  // near the largest numbers
    const auto y = number_at<float>(at);
    const auto narrow_nan = static_cast<float>(nan), narrow_infinity = static_cast<float>(infinity);
    const float narrow[] = {narrow_nan, narrow_infinity, -y, 4.0f * y, 1e30f, 0.0f};
    if (way < std::size(wide))
      put(at, wide[way]);
    else if (way - std::size(wide) < std::size(words))
      put(at, words[way - std::size(wide)]);
    else if (way < wide_ways)
      put(at, number_at<std::uint64_t>(any_place()));
    else if (way - wide_ways < std::size(narrow))
      put(at, narrow[way - wide_ways]);
    else
      put(at, way % 4 == 2   ? ~0u
              : way % 4 == 3 ? number_at<std::uint32_t>(any_place())
              : way % 4 == 0 ? 0x7fffffffu
                             : number_at<std::uint32_t>(at) + 1);
    what_ += " byte " + std::to_string(at) + " way " + std::to_string(way);
  }
  void undo() {
    forged_ = good_;
    what_.clear();
  }
  std::size_t any_place() { return 8 + 4 * (random_() % ((good_.size() - 16) / 4)); }
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
/// `others`, `several`: as in Forger.
void forge_states(const std::vector<int>& lengths, std::size_t others, std::size_t several) {
  std::size_t states = 0, refused = 0;
  for (const Kind& kind : all_kinds()) {
    const auto subject = kind.make({}, 0);
    const Spoilt unloaded{1, subject->numbers() - 1, 0.0};
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
      forger.each_number(others, judge);
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
  forge_states({11}, 40, 400);
}

// Forges numbers at every place. Runs on request only, because it takes minutes.
TEST_CASE("A state of every kind that is forged anywhere is refused or does no harm", "[.forged]") {
  forge_states({11, 4}, 1000, 20000);
}

TEST_CASE("A bad number in a motion of every kind is flagged, answered by zeros, and changes nothing",
          "[contract][bad-input]") {
  for (const Kind& kind : all_kinds()) {
    const int numbers = kind.make({}, 0)->numbers();
    for (int number = 0; number < numbers; ++number)
      for (const double by : {nan, infinity, -infinity}) {
        const auto spoilt = kind.make({}, 0), good = kind.make({}, 0);
        for (int k = 0; k < 10; ++k) {
          spoilt->step(k);
          good->step(k);
        }
        const Spoilt bad{1, number, by}, unnamed{1, -1, 0.0};
        Answers expected = good->step(10, &unnamed), got = spoilt->step(10, &bad);
        const std::string what = kind.name + ", number " + std::to_string(number);
        expect(got[1].status == Status::bad_input, (what + ": flagged").c_str());
        expect(std::all_of(got[1].bits.begin(), got[1].bits.end(), [](std::uint64_t b) { return b == 0; }),
               (what + ": answered by zeros").c_str());
        expect(spoilt->hash() == good->hash(), (what + ": a member without a motion").c_str());
        got[1] = expected[1];
        check_same(expected, got, "neighbours of a bad motion: " + what);
        check_same(good->step(11), spoilt->step(11), "after a bad motion: " + what);
      }
  }
}

TEST_CASE("An object of every kind that was reset is a new one", "[contract]") {
  for (const Kind& kind : all_kinds()) {
    const auto used = kind.make({}, 0), fresh = kind.make({}, 0);
    for (int k = 0; k < 15; ++k) used->step(k);
    used->reset();
    for (std::size_t m = 0; m < members; ++m) expect(used->hash(m) == fresh->hash(m), kind.name.c_str());
    for (int k = 15; k < 35; ++k) check_same(fresh->step(k), used->step(k), "reset: " + at_step(kind, k));
  }
}

}  // namespace bristle_test::test_contract
