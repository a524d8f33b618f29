// Code that PatchBatch, BedBatch, ExtendedPatches and JointFriction share in Python: use by one thread at a
// time, columns of responses and of the caller, the state as bytes.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "tools/products/python/module.hpp"

namespace bristle_python {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Ids = py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>;

/// Object of the library that only one Python thread at a time may use, because a step releases the
/// interpreter's lock.
template <class Batch>
class Owned {
 public:
  template <class... Arguments>
  explicit Owned(const Arguments&... arguments) : batch(arguments...) {}

  struct Turn : OneThread {
    explicit Turn(Owned& owner)
        : OneThread(owner.busy_,
                    "another thread is using this object; one thread at a time steps and reads") {}
  };

  Batch batch;

 private:
  std::atomic<bool> busy_{false};
};

template <class Batch>
inline constexpr bool is_module_class<Owned<Batch>> = true;

/// Makes arrays, by name of the column, from responses. Each array has an entry per response.
template <class Response>
class Columns {
 public:
  explicit Columns(const std::vector<Response>& responses) : responses_(responses) {
    py::array_t<std::uint32_t> status(static_cast<py::ssize_t>(responses.size()));
    for (std::size_t i = 0; i < responses.size(); ++i)
      status.mutable_data()[i] = static_cast<std::uint32_t>(responses[i].status);
    columns["status"] = status;
  }
  void add(const char* name, double Response::*field) {
    columns[name] = column({}, [=](const Response& r) { return &(r.*field); });
  }
  template <std::size_t n>
  void add(const char* name, double (Response::*field)[n]) {
    columns[name] = column({n}, [=](const Response& r) { return r.*field; });
  }
  template <std::size_t n>
  void add(const char* name, double (Response::*field)[n][n]) {
    columns[name] = column({n, n}, [=](const Response& r) { return (r.*field)[0]; });
  }

  py::dict columns;

 private:
  template <class Read>
  Numbers column(std::vector<std::size_t> shape, const Read& read) const {
    std::size_t width = 1;
    for (const std::size_t size : shape) width *= size;
    shape.insert(shape.begin(), responses_.size());
    Numbers values(shape);
    double* to = values.mutable_data();
    for (const Response& response : responses_) to = std::copy_n(read(response), width, to);
    return values;
  }
  const std::vector<Response>& responses_;
};

using Room = std::optional<py::array>;  // array of the caller that a step writes

/// All arrays of one step, by name. An array that the step writes may share no memory with another.
using Arrays = std::vector<std::pair<const char*, const py::array*>>;

/// Returns the memory of the caller's array of float64, uint64 or uint32 (Status), to be written in place; an
/// empty span for None.
template <class T>
bristle::Span<T> room_of(Arrays& arrays, const Room& array, std::size_t size, const char* name) {
  using Number = std::conditional_t<std::is_arithmetic_v<T>, T, std::uint32_t>;
  if (!array) return {};
  if (!py::isinstance<py::array_t<Number>>(*array))
    throw bristle::Error(std::string(name) + ": a numpy array of " +
                         std::string(py::str(py::dtype::of<Number>())) +
                         " is needed: it is written in place");
  if (static_cast<std::size_t>(array->size()) != size || (array->flags() & py::array::c_style) == 0 ||
      !array->writeable())
    throw bristle::Error(std::string(name) + ": a writeable array of " + std::to_string(size) +
                         " numbers, one after the other, is needed");
  for (const auto& [other_name, other] : arrays) refuse_overlap(name, *array, other_name, *other);
  arrays.emplace_back(name, &*array);
  return {static_cast<T*>(const_cast<void*>(array->data())), size};
}

/// Returns the numbers of an array that a step reads. For null it is an empty span.
inline bristle::Span<const double> numbers_in(Arrays& arrays, const Numbers* array, std::size_t size,
                                              const char* name) {
  if (array == nullptr) return {};
  if (static_cast<std::size_t>(array->size()) != size)
    throw bristle::Error(std::string(name) + ": an array of " + std::to_string(size) + " numbers is needed");
  arrays.emplace_back(name, array);
  return {array->data(), size};
}

inline const Numbers* pointer(const std::optional<Numbers>& array) { return array ? &*array : nullptr; }

/// Steps `count` members by step(). Releases the interpreter's lock only if there are many members: with few,
/// taking the lock again takes longer than the step.
template <class Step>
bristle::StepReport step_columns(std::size_t count, const Step& step) {
  if (count < 64) return step();
  const WithoutLock unlocked;
  return step();
}

/// Adds the methods state_hash, save_state, restore_state and len() to a Python class. `id` converts an int
/// to the library's id of a member of the batch; `argument` names that int in Python's signatures.
template <class Batch, class Id, class Count>
void define_state(py::class_<Owned<Batch>>& type, const char* argument, const Id& id, const Count& count) {
  using Self = Owned<Batch>;
  using Turn = typename Self::Turn;
  type.def(
          "state_hash",
          [id](Self& self, const std::optional<std::uint64_t>& of) {
            const Turn turn(self);
            return of ? self.batch.state_hash(id(*of)) : self.batch.state_hash();
          },
          py::arg(argument) = py::none(), "Of one, or of all: equal on every machine.")
      .def(
          "save_state",
          [](Self& self) {
            const Turn turn(self);
            std::vector<std::byte> state(self.batch.state_size());
            self.batch.save_state({state.data(), state.size()});
            return py::bytes(reinterpret_cast<const char*>(state.data()), state.size());
          },
          "The state of all as bytes.")
      .def(
          "restore_state",
          [](Self& self, const py::bytes& state) {
            const Turn turn(self);
            const std::string bytes = state;
            self.batch.restore_state({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()});
          },
          py::arg("state"),
          "Restores what save_state gave, in an object made in the same way. Raises bristle.Error, state "
          "unchanged, where it does not fit.")
      .def(
          "__reduce__",
          [](const py::object& self) -> py::object {
            throw py::type_error(std::string(Py_TYPE(self.ptr())->tp_name) +
                                 " is not copied or pickled as a whole: make another in the same way, and "
                                 "give its restore_state() the bytes of save_state()");
          },
          "Raises TypeError, which says what to do instead.")
      .def("__len__", [count](Self& self) {
        const Turn turn(self);
        return count(self.batch);
      });
}

}  // namespace bristle_python
