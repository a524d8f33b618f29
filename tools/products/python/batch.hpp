// PatchBatch as Python sees it.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "tools/products/python/module.hpp"

namespace bristle_python {

/// Arguments of PatchBatch's constructor in Python other than patches.
struct ThreadsAndKernels {
  int threads = 1;
  std::optional<std::string> isa;
  int servo_core = -1;

  bristle::BatchOptions options() const {
    return bristle::BatchOptions{}
        .with_threads(threads)
        .with_isa(isa ? isa->c_str() : nullptr)
        .with_servo_core(servo_core);
  }
};

/// Batch that only one Python thread at a time may step or read, because a step releases the interpreter's
/// lock.
class Batch {
 public:
  explicit Batch(ThreadsAndKernels made_with)
      : made_with_(std::move(made_with)), batch(made_with_.options()) {}
  const ThreadsAndKernels& made_with() const noexcept { return made_with_; }

  /// Marks the batch as in use while this object lives.
  struct Turn : OneThread {
    explicit Turn(Batch& owner)
        : OneThread(owner.stepping_,
                    "PatchBatch: another thread is stepping this batch; one thread steps and reads") {}
  };

 private:
  ThreadsAndKernels made_with_;

 public:
  bristle::PatchBatch batch;

 private:
  std::atomic<bool> stepping_{false};
};

template <>
inline constexpr bool is_module_class<Batch> = true;

// Functions that save and copy the state of a batch (batch_state.cpp).

py::bytes save_state(Batch& self);
void restore_state(Batch& self, const py::bytes& state);
/// Returns data from which unpickled() makes a batch with equal patches, ids and state.
py::object pickled(Batch& self);
/// Makes a batch from the data that pickled() returned. Throws bristle::Error for data of another form.
std::unique_ptr<Batch> unpickled(const py::object& state);

}  // namespace bristle_python
