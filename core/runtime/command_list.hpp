// Hands changes from the thread that adds patches to the stepping thread, and what they replaced back
// for freeing. Unbounded, one producer, one consumer, no lock; the consumer neither allocates nor frees.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/patches/patch_state.hpp"

namespace bristle::detail {

/// Where the stepping thread finds patches by slot, and the queue of move(). Replaced whole when it is
/// too small, so that the stepping thread never allocates.
struct SlotTable {
  struct Slot {
    std::unique_ptr<PatchState> patch;
    std::uint32_t generation = 0;
    std::uint32_t queued = 0;  ///< 1 + index of the motion that move() set
  };
  explicit SlotTable(std::uint32_t size)
      : capacity(size), slots(size), motions(size), responses(size), last(size) {}

  std::uint32_t capacity;
  std::vector<Slot> slots;
  std::vector<Motion> motions;      ///< what move() asked for
  std::vector<Response> responses;  ///< to these
  std::vector<Response> last;       ///< by slot, what force() reads
};

struct Command {
  enum class Kind : unsigned char { none, add, replace, remove, grow };
  Kind kind = Kind::none;
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;
  std::unique_ptr<PatchState> patch;    ///< comes with the command; goes back with what it replaced
  std::unique_ptr<PatchState> scratch;  ///< when the batch's is too small for this patch
  std::unique_ptr<SlotTable> table;     ///< of `grow`, the same way
  std::atomic<Command*> next{nullptr};
};

class CommandList {
 public:
  CommandList() : newest_(new Command), oldest_(newest_), taken_(newest_) {}
  ~CommandList() {
    while (oldest_ != nullptr) {
      Command* next = oldest_->next.load(std::memory_order_acquire);
      delete oldest_;
      oldest_ = next;
    }
  }
  CommandList(const CommandList&) = delete;
  CommandList& operator=(const CommandList&) = delete;

  /// Producer: appends, and frees what the consumer is done with.
  void push(std::unique_ptr<Command> command) {
    Command* const added = command.release();
    newest_->next.store(added, std::memory_order_release);
    newest_ = added;
    Command* const taken = taken_.load(std::memory_order_acquire);
    while (oldest_ != taken) {
      Command* const next = oldest_->next.load(std::memory_order_acquire);
      delete oldest_;
      oldest_ = next;
    }
  }

  /// Consumer: the next command, or null. It stays valid until the one after it was taken: what is
  /// left in it then goes back to the producer.
  Command* take() noexcept {
    Command* const next = current_->next.load(std::memory_order_acquire);
    if (next == nullptr) return nullptr;
    taken_.store(current_ = next, std::memory_order_release);
    return next;
  }

 private:
  Command* newest_;              ///< producer's
  Command* oldest_;              ///< producer's: first not yet freed
  std::atomic<Command*> taken_;  ///< the last command the consumer took; those before it are free
  Command* current_ = newest_;   ///< consumer's
};

}  // namespace bristle::detail
