// Exports the simulated block of the interactive page to JavaScript, as plain functions and arrays of
// numbers.
#include <algorithm>
#include <array>
#include <string>
#include <type_traits>

#include <fmt/format.h>
#include <bristle/fields.hpp>

#include "block.hpp"
#include "comparison.hpp"
#include "tests/golden_script.hpp"

#define BRISTLE_PAGE(name) __attribute__((export_name(#name)))

namespace {

page::Block& block() {
  static page::Block it;
  return it;
}

/// Calls visit(field) for the numbers of Coefficients, in the order of the library's table of fields.
template <class Visit>
void for_each_coefficient(Visit&& visit) {
  bristle::for_each_field<bristle::Coefficients>([&visit](const auto& field) {
    using Member = std::remove_cvref_t<decltype(field.member)>;
    if constexpr (std::is_same_v<Member, double bristle::Coefficients::*>) visit(field);
  });
}

}  // namespace

extern "C" {

BRISTLE_PAGE(version) const char* version() { return bristle::library_version(); }

/// Returns the state hashes of tests/data/golden_hash.csv as computed in this build, with a blank after each,
/// so that a test can compare them.
BRISTLE_PAGE(golden_hashes) const char* golden_hashes() {
  static std::string text;
  text.clear();
  for (const bristle_test::Golden& golden : bristle_test::run_golden_script()) text += golden.hash + " ";
  return text.c_str();
}

/// Returns the numbers of bristle::Coefficients as the library's table of fields lists them, one a line:
/// name, unit, meaning, least value, largest value, default, with tabs between.
BRISTLE_PAGE(coefficients) const char* coefficients() {
  static const std::string text = [] {
    std::string lines;
    for_each_coefficient([&lines](const auto& field) {
      lines += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\n", field.name, field.about.unit, field.about.text,
                           field.about.least, field.about.most, bristle::Coefficients{}.*field.member);
    });
    return lines;
  }();
  return text.c_str();
}

/// Returns where JavaScript writes the coefficients that configure() takes: a value for each line of
/// coefficients().
BRISTLE_PAGE(coefficient_values) double* coefficient_values() {
  static std::array<double, 64> values;
  return values.data();
}

/// Applies coefficient_values() and other settings. `contact` is 0 for bristles that snap, 1 for the infinite
/// brush, 2 for bristles that slide. Throws bristle::Error, after which the settings are unchanged.
BRISTLE_PAGE(configure)
void configure(int contact, int bristle_count, double normal_load, double spring_stiffness) {
  page::BlockSettings settings;
  settings.infinite = contact == 1;
  settings.bristles = static_cast<std::uint32_t>(bristle_count);
  settings.normal_load = normal_load;
  settings.spring_stiffness = spring_stiffness;
  settings.coefficients.with_rule(contact == 2 ? bristle::SnapRule::slide : bristle::SnapRule::redraw);
  const double* value = coefficient_values();
  for_each_coefficient([&](const auto& field) { settings.coefficients.*field.member = *value++; });
  block().set(settings);
}

BRISTLE_PAGE(reset) void reset() { block().reset(); }
BRISTLE_PAGE(grab) void grab() { block().grab(); }
BRISTLE_PAGE(move_hand) void move_hand(double position_m) { block().move_hand(position_m); }
BRISTLE_PAGE(release) void release() { block().release(); }

BRISTLE_PAGE(step) void step(int count) {
  for (int i = 0; i < count; ++i) block().step();
}

/// Returns the numbers of the block's present state, in the order of their names in web/library.mjs.
BRISTLE_PAGE(state) const double* state() {
  static std::array<double, 10> values;
  const page::Block& now = block();
  const bristle::PatchInfo info = now.info();
  values = {now.position(),
            now.velocity(),
            now.hand(),
            now.held() ? 1.0 : 0.0,
            now.response().end[0],
            now.kinetic_friction(),
            now.peak_friction(),
            static_cast<double>(now.steps()),
            1.0 * info.representatives,
            info.active};
  return values.data();
}

/// Returns the ring buffer of the block's past states, four numbers each: time (s), position (m), friction
/// (N), spring force (N).
BRISTLE_PAGE(samples) const double* samples() { return &block().samples().front().time; }
BRISTLE_PAGE(samples_remembered) int samples_remembered() {
  return static_cast<int>(page::Block::remembered);
}

/// Returns the deflections (m) of the first `count` bristles; 0 for bristles that the patch does not have.
BRISTLE_PAGE(bends) const double* bends(int count) {
  static double values[512];
  const auto wanted = static_cast<std::size_t>(std::clamp(count, 0, 512));
  const std::size_t written = block().read_bends({values, wanted});
  std::fill(values + written, values + wanted, 0.0);
  return values;
}

/// Returns the name of model number `model` of a comparison, or "" past the last.
BRISTLE_PAGE(compared_model) const char* compared_model(int comparison, int model) {
  static std::string name;
  const std::vector<std::string> names = page::compared_models(comparison);
  name = model < static_cast<int>(names.size()) ? names[static_cast<std::size_t>(model)] : std::string();
  return name.c_str();
}
/// Runs a comparison for one of its models. Returns an array: the measured value, whether the phenomenon is
/// shown, the number of points of the curve, and x and y of each.
BRISTLE_PAGE(compare) const double* compare(int comparison, int model) {
  static std::vector<double> values;
  const page::Compared compared =
      page::compare(comparison, page::compared_models(comparison).at(static_cast<std::size_t>(model)));
  values = {compared.finding, compared.shown ? 1.0 : 0.0, static_cast<double>(compared.points.size() / 2)};
  values.insert(values.end(), compared.points.begin(), compared.points.end());
  return values.data();
}
BRISTLE_PAGE(step_microseconds) double step_microseconds() { return page::step_microseconds(); }
}
