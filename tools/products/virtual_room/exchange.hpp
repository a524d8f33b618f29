// Exchange between the haptic and the graphic loop, without lock, waiting or allocation on either side.
// A value of which only the newest counts (room, settings, hand) goes through a triple buffer: the writer
// never waits, the reader sees the newest whole value. Items that must all arrive (acts, which are a user's
// requests; points of plots) go through a ring; while it is full, new items are dropped and counted.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "tools/products/virtual_room/room_state.hpp"

namespace room {

inline constexpr std::size_t cache_line = 64;

/// Triple buffer: passes the newest value from one writing thread to one reading thread. A value that is not
/// read before the next is published is lost.
template <class T>
class TripleBuffer {
 public:
  /// @name Writing thread
  ///@{

  /// Returns the slot to fill before publish(). Set every member, because the slot has an old value in it.
  T& draft() noexcept { return slots_[writing_].value; }
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

  /// Takes the newest value published since the last call; if there is none it returns false and leaves
  /// latest() unchanged.
  bool refresh() noexcept {
    if (!(middle_.load(std::memory_order_relaxed) & fresh)) return false;
    reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & index;
    return true;
  }
  const T& latest() const noexcept {
    return slots_[reading_].value;
  }  ///< newest value; it stays valid until refresh()
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

/// Queue from one writing thread to one reading thread. It has room for `capacity` values, a power of two.
template <class T, std::size_t capacity>
class SpscRing {
  static_assert(capacity > 0 && (capacity & (capacity - 1)) == 0);

 public:
  /// Appends a value; for the writing thread. If the ring is full, drops the value, counts the loss and
  /// returns false.
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
  /// Takes the oldest value; for the reading thread. Returns false if the ring is empty.
  bool pop(T& value) noexcept {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    if (at == written_.load(std::memory_order_acquire)) return false;
    value = values_[at & (capacity - 1)];
    read_.store(at + 1, std::memory_order_release);
    return true;
  }
  /// Returns the number of values lost because the ring was full. Any thread may call it.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::array<T, capacity> values_{};
  alignas(cache_line) std::atomic<std::size_t> written_{0};
  alignas(cache_line) std::atomic<std::size_t> read_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

/// Channels between three threads: the haptic one; the graphic one, which shows the room; and the desk, which
/// works beside the haptic thread and may allocate and read files (haptic_loop.cpp).
struct Exchange {
  TripleBuffer<Snapshot> room;        ///< haptic to graphic: room after each tick
  SpscRing<PlotPoint, 1 << 14> plot;  ///< haptic to graphic: a point per tick, 16 s at 1 kHz
  TripleBuffer<Settings> settings;    ///< graphic to desk: the user's settings
  TripleBuffer<MouseHand> mouse;      ///< graphic to haptic: hand moved by mouse
  SpscRing<Act, 64> acts;             ///< graphic to haptic: the user's requests, in order
};

}  // namespace room
