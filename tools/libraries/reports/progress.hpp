// Shows a line of progress on stderr once work has taken a second, if stderr is a terminal and `quiet` is not
// set.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "tools/libraries/platform/platform.hpp"

namespace cli {

class Progress {
 public:
  explicit Progress(std::string label, bool quiet = false)
      : label_(std::move(label)), terminal_(!quiet && platform::is_terminal(stderr)) {}
  ~Progress() {
    if (shown_) std::fputs("\r\033[K", stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Updates the share of the work that is done (0 to 1). Cheap enough to be called every hundredth step of a
  /// run.
  void update(double share, const char* what = "") {
    if (terminal_ && Clock::now() >= next_) show(share, what);
  }
  /// Shows the line of progress at once. Call it before work that may take seconds without an update().
  void show(double share, const char* what = "") {
    if (!terminal_) return;
    next_ = Clock::now() + std::chrono::milliseconds(200);
    shown_ = true;
    char text[80];  // limit of 79 characters, as a wrapped line could not be erased
    std::snprintf(text, sizeof text, "%s: %3.0f %% %s", label_.c_str(), 100.0 * share, what);
    std::fprintf(stderr, "\r\033[K%s", text);
    std::fflush(stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(1);
};

/// Says on stderr, if that is a terminal, how long work will take that takes more than ten seconds. Calls
/// `estimate`, which returns that time in s, only if it may say so.
template <class Estimate>
void announce(const char* label, bool quiet, const Estimate& estimate) {
  if (quiet || !platform::is_terminal(stderr)) return;
  const double seconds = estimate();
  if (seconds <= 10.0) return;
  std::fprintf(stderr, "%s: will take about %.0f s; Ctrl-C gives the best found until then\n", label,
               seconds);
}

/// Stopwatch that runs from its construction on.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
};

/// Returns a function that shows a line of progress. The line disappears with the function's last copy.
inline std::function<void(double)> progress_line(std::string label, bool quiet = false) {
  return [line = std::make_shared<Progress>(std::move(label), quiet)](double share) { line->update(share); };
}

}  // namespace cli
