// Shares code of PatchBatch, BedBatch, ExtendedPatches and JointFriction in Python: use by one thread at a
// time, columns of responses, the state as bytes.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
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

/// Makes arrays by column name from responses, with a row per response.
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
