// Makes the snaps of bristles audible.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

namespace room {

/// Sound of snaps: the snaps of each tick strike a resonator, whose tone dies away within milliseconds.
class SnapTone {
 public:
  static constexpr int samples_per_second = 8000;
  static constexpr double tone_hz = 1200.0, decay_s = 2e-3;

  /// Appends `samples` samples of sound for a tick in which `snaps` bristles snapped. Loudness grows with the
  /// square root of the snaps: 400 in a tick strike at full scale.
  void add(float snaps, int samples, std::vector<std::int16_t>& to) {
    const double rest = std::exp(-1.0 / (decay_s * samples_per_second));
    const double turn = 2.0 * 3.14159265358979 * tone_hz / samples_per_second;
    for (int i = 0; i < samples; ++i) {
      const double strike = i == 0 ? std::fmin(0.05 * std::sqrt(static_cast<double>(snaps)), 1.0) : 0.0;
      const double next = 2.0 * rest * std::cos(turn) * last_ - rest * rest * before_ + strike;
      before_ = last_;
      last_ = next;
      to.push_back(static_cast<std::int16_t>(12000.0 * std::fmax(-2.0, std::fmin(2.0, next))));
    }
  }

 private:
  double last_ = 0.0, before_ = 0.0;
};

/// Player of the snaps' sound: a program of PulseAudio or ALSA that reads samples from a pipe.
class SnapPlayer {
 public:
  /// Starts the player program. Returns false if the system has none.
  bool start();
  void stop() { pipe_.reset(); }
  bool plays() const { return pipe_ != nullptr; }
  /// Adds the sound of a tick that lasts 1 / rate_hz seconds.
  void add(float snaps, double rate_hz) {
    if (plays()) tone_.add(snaps, static_cast<int>(SnapTone::samples_per_second / rate_hz), samples_);
  }
  /// Sends the added sound; drops what the pipe does not take. Returns false, and stops, if the player ended.
  bool send();

 private:
  struct Close {
    void operator()(std::FILE* pipe) const;
  };
  SnapTone tone_;
  std::vector<std::int16_t> samples_;
  std::unique_ptr<std::FILE, Close> pipe_;
};

}  // namespace room
