#include "tools/libraries/run/run_state.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

constexpr std::string_view first_line = "bristle run 1\n";
constexpr std::size_t numbers_of_run = 4;  // numbers behind the first line: steps, dt, copies, bodies
constexpr std::size_t numbers_per_path = 4;

/// Appends numbers as little-endian 64-bit floats.
void append_numbers(std::string& bytes, const std::vector<double>& numbers) {
  for (const double number : numbers) {
    const auto bits = std::bit_cast<std::uint64_t>(number);
    for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<char>(bits >> shift));
  }
}

/// Reads bytes as numbers. Up to seven bytes at the end, too few for a number, are ignored.
std::vector<double> to_numbers(std::string_view bytes) {
  std::vector<double> numbers(bytes.size() / 8);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    std::uint64_t bits = 0;
    for (std::size_t k = 8; k-- > 0;) bits = bits << 8 | static_cast<unsigned char>(bytes[8 * i + k]);
    numbers[i] = std::bit_cast<double>(bits);
  }
  return numbers;
}

}  // namespace

std::string save_run(const SceneStepper& stepper, std::uint64_t steps, double dt,
                     const std::vector<CopyPath>& copy_paths) {
  std::vector<double> numbers = {static_cast<double>(steps), dt, static_cast<double>(copy_paths.size()),
                                 static_cast<double>(stepper.bodies().size())};
  for (const CopyPath& path : copy_paths)
    numbers.insert(numbers.end(), {path.x, path.y, path.slid_x, path.slid_y});
  const std::vector<double> body_states = stepper.body_states();
  numbers.insert(numbers.end(), body_states.begin(), body_states.end());
  std::string bytes(first_line);
  append_numbers(bytes, numbers);
  const std::size_t head = bytes.size();
  bytes.resize(head + stepper.batch().state_size());
  stepper.batch().save_state({reinterpret_cast<std::byte*>(bytes.data() + head), bytes.size() - head});
  return bytes;
}

std::uint64_t restore_run(const std::string& path, SceneStepper& stepper, double dt,
                          std::vector<CopyPath>& copy_paths) {
  const std::size_t body_states = stepper.body_states().size();
  const std::size_t head = 8 * (numbers_of_run + numbers_per_path * copy_paths.size() + body_states);
  const auto refuse = [&path](const std::string& why) { throw UserError(fmt::format("{}: {}", path, why)); };
  const std::string file = read_text_file(
      path, std::max(most_data_bytes, first_line.size() + head + stepper.batch().state_size()), true);
  if (!file.starts_with(first_line)) refuse("is no state of a run; bristle run --save-state writes it");
  const std::string_view bytes = std::string_view(file).substr(first_line.size());
  const std::vector<double> numbers = to_numbers(bytes.substr(0, head));
  if (numbers.size() < numbers_of_run) refuse("is cut short");
  const auto bodies = static_cast<double>(stepper.bodies().size());
  if (numbers[2] != static_cast<double>(copy_paths.size()) || numbers[3] != bodies)
    refuse(fmt::format("is of a scene with {} patches and {} bodies; this one has {} and {}", numbers[2],
                       numbers[3], copy_paths.size(), bodies));
  if (numbers[1] != dt)
    refuse(fmt::format("was saved with steps of {} s; the scene's dt is {} s", numbers[1], dt));
  if (bytes.size() < head) refuse("is cut short");
  const bool finite = std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
  if (!finite || !(numbers[0] >= 0.0 && numbers[0] <= 1e15) || numbers[0] != std::floor(numbers[0]))
    refuse("its step count, or a place in it, is not a finite number in range: the file is damaged");
  try {
    stepper.batch().restore_state(
        {reinterpret_cast<const std::byte*>(bytes.data() + head), bytes.size() - head});
  } catch (const bristle::Error& error) {
    refuse(error.what());
  }
  const double* at = numbers.data() + numbers_of_run;
  for (CopyPath& it : copy_paths) {
    it = {at[0], at[1], at[2], at[3]};
    at += numbers_per_path;
  }
  const auto steps = static_cast<std::uint64_t>(numbers[0]);
  stepper.set_body_states({at, body_states}, steps);
  return steps;
}

}  // namespace cli
