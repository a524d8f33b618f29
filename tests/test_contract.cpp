// The contract of every kind of object: same bits on every instruction set, number of threads and in any
// company; a trial answers as the step and leaves no trace; a saved state goes on with the same bits; a
// damaged one, and bad input, are refused and change nothing; a reset object is a new one. Every output is
// compared.
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
    const auto one = kind.make({}, 0), many = kind.make(BatchOptions{}.with_threads(3), 3000);
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
