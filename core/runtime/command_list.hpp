// A queue of changes from the thread that adds patches (producer) to the stepping thread (consumer). Memory
// that a change replaces goes back to the producer to be freed. The queue has no bound and no lock, and the
// consumer neither allocates nor frees, so that a step stays within its deadline.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <new>

#include "core/patches/record_memory.hpp"
#include "core/runtime/patch_pool.hpp"

namespace bristle::detail {

/// Memory for the copy of a patch on which find_force() tries a load.
struct Scratch {
  struct Free {
    void operator()(std::byte* freed) const noexcept {
      ::operator delete (freed, std::align_val_t{column_alignment});
    }
  };
  std::unique_ptr<std::byte, Free> memory;
  std::size_t bytes = 0;
};

/// A change to an object made over a batch (ExtendedPatches), applied in order with the batch's own commands.
/// It keeps the memory that it replaces until the producer frees the change.
struct Change {
  virtual ~Change() = default;
  virtual void apply() noexcept = 0;
};

struct Command {
  enum class Kind : unsigned char { none, add, replace, remove, grow, change };
  // The fields up to `patch` lie in the first cache line; commands of the kinds add, replace and remove need
  // no others, so reading one costs one cache miss.
  Kind kind = Kind::none;
  std::uint32_t slot = 0;
  std::uint64_t number = 0;  ///< number of the command in the order of push()
  std::atomic<Command*> next{nullptr};
  /// Record of the patch that a command of kind `remove` took out of the batch. The producer frees it with
  /// the command.
  PatchRecord* removed = nullptr;
  /// Scratch memory for copies of the new patch, if it needs more than the batch has. It is swapped with the
  /// batch's.
  Scratch scratch;
  std::unique_ptr<PatchChunk> chunk;  ///< chunk of slots with the number `slot`, for a command of kind `grow`

  /// Patch to be added or put in place, for a command of kind `add` or `replace`. After a `replace` it is the
  /// patch that was replaced. The command owns the record of the patch.
  Patch patch;
  std::unique_ptr<Change> change;  ///< change that a command of kind `change` applies

  Command() = default;
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  ~Command() {
    release(removed);
    release(patch.record);
  }
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

  /// Appends a command, and frees commands that the consumer has finished; for the producer. With publishes =
  /// false the consumer sees the command only after the next publish(), so that several commands take effect
  /// together.
  void push(std::unique_ptr<Command> command, bool publishes = true) {
    Command* const added = command.release();
    added->number = newest_->number + 1;
    newest_->next.store(added, std::memory_order_release);
    newest_ = added;
    if (publishes) publish();
    Command* const taken = taken_.load(std::memory_order_acquire);
    while (oldest_ != taken) {
      Command* const next = oldest_->next.load(std::memory_order_acquire);
      delete oldest_;
      oldest_ = next;
    }
  }

  void publish() noexcept { pushed_.store(newest_->number, std::memory_order_release); }

  /// Returns the number of the last published command, for the consumer. A consumer that stops at this number
  /// comes to an end, however fast the producer appends.
  std::uint64_t pushed() const noexcept { return pushed_.load(std::memory_order_acquire); }

  /// Returns the next command up to number `last`, null if there is none; for the consumer. The command stays
  /// valid until the next one is taken; then the producer may free it.
  Command* take(std::uint64_t last) noexcept {
    if (current_->number >= last) return nullptr;
    Command* const next = current_->next.load(std::memory_order_acquire);
    if (next == nullptr) return nullptr;
    taken_.store(current_ = next, std::memory_order_release);
    return next;
  }

 private:
  Command* newest_;              ///< newest command, for the producer
  Command* oldest_;              ///< first command not yet freed, for the producer
  std::atomic<Command*> taken_;  ///< last command that the consumer took; earlier ones may be freed
  Command* current_ = newest_;   ///< command that the consumer is executing
  std::atomic<std::uint64_t> pushed_{0};
};

}  // namespace bristle::detail
