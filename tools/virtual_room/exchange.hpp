// Exchange between haptic and graphic loop: no lock, no waiting, no allocation on either side.
//
// What has a newest value (the room, the settings, the hand) goes through a triple buffer: the writer never
// waits, the reader sees the newest whole value. What must arrive one by one (acts, points of the plots) goes
// through a ring that drops and counts the newest where it is full.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "tools/virtual_room/room_state.hpp"

namespace room {

inline constexpr std::size_t cache_line = 64;

/// The newest value of one writing thread for one reading thread. Values between two looks are lost.
template <class T>
class TripleBuffer {
 public:
  /// @name Writing thread
  ///@{
  T& draft() noexcept { return slots_[writing_].value; }  ///< to be filled whole: holds an old value
  void publish() noexcept {
    const unsigned before = middle_.exchange(writing_ | fresh, std::memory_order_acq_rel);
    writing_ = before & index;
  }
  void write(const T& value) noexcept {
    draft() = value;
    publish();
  }
  ///@}

  /// @name Reading thread
  ///@{
  /// Takes what was published since the last call; false when nothing was, and then latest() stays.
  bool refresh() noexcept {
    if (!(middle_.load(std::memory_order_relaxed) & fresh)) return false;
    reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & index;
    return true;
  }
  const T& latest() const noexcept {
    return slots_[reading_].value;
  }  ///< stays until refresh()
     ///@}

 private:
  static constexpr unsigned index = 3, fresh = 4;
  struct alignas(cache_line) Slot {
    T value{};
  };
  std::array<Slot, 3> slots_;
  alignas(cache_line) unsigned writing_ = 0;
  alignas(cache_line) std::atomic<unsigned> middle_{1};
  alignas(cache_line) unsigned reading_ = 2;
};

/// A queue from one writing to one reading thread. Holds `capacity` values, a power of two.
template <class T, std::size_t capacity>
class SpscRing {
  static_assert(capacity > 0 && (capacity & (capacity - 1)) == 0);

 public:
  /// Writing thread: false, and counted, when the ring is full.
  bool push(const T& value) noexcept {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    if (at - read_.load(std::memory_order_acquire) == capacity) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    values_[at & (capacity - 1)] = value;
    written_.store(at + 1, std::memory_order_release);
    return true;
  }
  /// Reading thread: false when the ring is empty.
  bool pop(T& value) noexcept {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    if (at == written_.load(std::memory_order_acquire)) return false;
    value = values_[at & (capacity - 1)];
    read_.store(at + 1, std::memory_order_release);
    return true;
  }
  /// Values that found no room. Any thread.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::array<T, capacity> values_{};
  alignas(cache_line) std::atomic<std::size_t> written_{0};
  alignas(cache_line) std::atomic<std::size_t> read_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

/// Everything that passes between the loops. "Graphic" is the one thread that shows the room; "desk" the one
/// beside the haptic thread (haptic_loop.cpp).
struct Exchange {
  TripleBuffer<Snapshot> room;        ///< haptic to graphic: the end of each tick
  SpscRing<PlotPoint, 1 << 14> plot;  ///< haptic to graphic: each tick, 16 s at 1 kHz
  TripleBuffer<Settings> settings;    ///< graphic to desk, all of them at once
  TripleBuffer<MouseHand> mouse;      ///< graphic to haptic: the mouse as a device
  SpscRing<Act, 64> acts;             ///< graphic to haptic, in order
};

}  // namespace room
