#include "tools/libraries/run/run_state.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstring>

#include <fmt/format.h>

#include <bristle/error.hpp>
#include <bristle/state_file.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

constexpr std::size_t numbers_of_run = 4;  // numbers at the head of a saved run: steps, dt, copies,
                                           // bodies
constexpr std::size_t numbers_per_way = 4;

/// Converts numbers to little-endian 64-bit floats, the form in which a run (but its patches) is saved.
std::vector<std::byte> to_bytes(const std::vector<double>& numbers) {
  std::vector<std::byte> bytes;
  for (const double number : numbers) {
    const auto bits = std::bit_cast<std::uint64_t>(number);
    for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<std::byte>(bits >> shift));
  }
  return bytes;
}

std::vector<double> to_numbers(const std::vector<std::byte>& bytes) {
  std::vector<double> numbers(bytes.size() / 8);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    std::uint64_t bits = 0;
    for (std::size_t k = 8; k-- > 0;) bits = bits << 8 | static_cast<std::uint64_t>(bytes[8 * i + k]);
    numbers[i] = std::bit_cast<double>(bits);
  }
  return numbers;
}

}  // namespace

void check_place_of_state(const std::string& path) {
  if (path == "-") throw UserError("--save-state -: a state cannot go to stdout; name a file");
  const platform::Kind there = platform::kind_of(path);
  int why = there == platform::Kind::nothing ? errno : 0;
  if (there == platform::Kind::other)
    throw UserError(path + ": is not a file: a state file cannot take its place");
  if (why == 0 || why == ENOENT)
    why = platform::takes_files(platform::path_of(path).parent_path()) ? 0 : errno;
  if (why != 0) throw UserError(fmt::format("{}: cannot be written: {}", path, std::strerror(why)));
}

void save_run(const std::string& path, const SceneStepper& stepper, std::uint64_t steps, double dt,
              const std::vector<Way>& ways) {
  std::vector<double> numbers = {static_cast<double>(steps), dt, static_cast<double>(ways.size()),
                                 static_cast<double>(stepper.bodies().size())};
  for (const Way& way : ways) numbers.insert(numbers.end(), {way.x, way.y, way.slid_x, way.slid_y});
  const std::vector<double> places = stepper.places();
  numbers.insert(numbers.end(), places.begin(), places.end());
  try {
    bristle::save_state_file(path, stepper.batch(), to_bytes(numbers));
  } catch (const bristle::Error& error) {
    throw UserError(error.what());
  }
}

std::uint64_t restore_run(const std::string& path, SceneStepper& stepper, double dt, std::vector<Way>& ways) {
  const std::size_t places = stepper.places().size();
  const std::size_t wanted = numbers_of_run + numbers_per_way * ways.size() + places;
  const auto refuse = [&path](const std::string& why) { throw UserError(fmt::format("{}: {}", path, why)); };
  try {
    // Reads no file larger than a saved state of this scene can be; it is refused instead.
    constexpr std::size_t head = 64;
    const bristle::StateFile file =
        bristle::read_state_file(path, stepper.batch().state_size() + 8 * wanted + head);
    const std::vector<double> numbers = to_numbers(file.extra);
    if (numbers.size() < numbers_of_run)
      refuse("holds patches, but not the state of a run; it must be written by bristle run --save-state");
    const auto bodies = static_cast<double>(stepper.bodies().size());
    if (numbers.size() != wanted || numbers[2] != static_cast<double>(ways.size()) || numbers[3] != bodies)
      refuse(fmt::format("is of a scene with {} patches and {} bodies; this one has {} and {}", numbers[2],
                         numbers[3], ways.size(), bodies));
    if (numbers[1] != dt)
      refuse(fmt::format("was saved with steps of {} s; the scene's dt is {} s", numbers[1], dt));
    const bool finite =
        std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
    if (!finite || !(numbers[0] >= 0.0 && numbers[0] <= 1e15) || numbers[0] != std::floor(numbers[0]))
      refuse("its step count, or a place in it, is not a finite number in range: the file is damaged");
    stepper.batch().restore_state(file.state);
    const double* at = numbers.data() + numbers_of_run;
    for (Way& way : ways) {
      way = {at[0], at[1], at[2], at[3]};
      at += numbers_per_way;
    }
    const auto steps = static_cast<std::uint64_t>(numbers[0]);
    stepper.set_places({at, places}, steps);
    return steps;
  } catch (const bristle::Error& error) {
    const std::string why = error.what();
    if (why.starts_with(path)) throw UserError(why);
    refuse(why);
  }
  return 0;
}

}  // namespace cli
