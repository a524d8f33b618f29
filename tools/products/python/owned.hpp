// Code that PatchBatch, BedBatch, ExtendedPatches, JointFriction and the pools of keys share in Python: use
// by one thread at a time, columns of responses and of the caller, the state as bytes.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "tools/products/python/module.hpp"

namespace bristle_python {

using namespace pybind11::literals;

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Ids = py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>;

/// Object of the library that only one Python thread at a time may use, because a step releases the
/// interpreter's lock.
template <class Batch>
class Owned {
 public:
  template <class... Arguments>
  explicit Owned(const Arguments&... arguments) : batch(arguments...) {}

  /// Marks the object as in use. Throws bristle::Error if another thread is using it.
  class Turn {
   public:
    explicit Turn(Owned& owner) : busy_(owner.busy_) {
      if (busy_.exchange(true))
        throw bristle::Error("another thread is using this object; one thread at a time steps and reads");
    }
    ~Turn() { busy_.store(false); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    std::atomic<bool>& busy_;
  };

  /// Returns call(batch), made in a turn.
  template <class Call>
  decltype(auto) use(const Call& call) {
    const Turn turn(*this);
    return call(batch);
  }

  Batch batch;

 private:
  std::atomic<bool> busy_{false};
};

template <class Batch>
inline constexpr bool is_module_class<Owned<Batch>> = true;

/// Makes a method of the library's object a function of its owner in Python, called in the owner's turn.
template <class Self, class Object, class Result, class... Arguments>
auto in_turn(Result (Object::*method)(Arguments...)) {
  return [method](Self& self, Arguments... arguments) -> Result {
    return self.use([&](auto& object) -> Result { return (object.*method)(arguments...); });
  };
}
template <class Self, class Object, class Result, class... Arguments>
auto in_turn(Result (Object::*method)(Arguments...) const) {
  return [method](Self& self, Arguments... arguments) -> Result {
    return self.use([&](auto& object) -> Result { return (object.*method)(arguments...); });
  };
}

/// Returns the columns of structs, each as an array of its own, by name. The struct needs a
/// PYBIND11_NUMPY_DTYPE. Copies the columns here, because numpy's copy() lets go of the interpreter's lock: a
/// daemon thread of a program that ends meanwhile would end within this call.
template <class Row>
py::dict columns_of(const std::vector<Row>& rows) {
  const py::dtype row = py::dtype::of<Row>();
  const py::object fields = row.attr("fields");
  const auto* const from = reinterpret_cast<const std::byte*>(rows.data());
  py::dict columns;
  for (const py::handle name : row.attr("names")) {
    const py::tuple field = fields[name];  // type and offset in bytes
    const auto type = field[0].cast<py::dtype>();
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(rows.size())};
    for (const py::handle size : type.attr("shape")) shape.push_back(size.cast<py::ssize_t>());
    py::array column(type.attr("base").cast<py::dtype>(), shape);
    const auto offset = field[1].cast<std::size_t>(), width = static_cast<std::size_t>(type.itemsize());
    auto* const to = static_cast<std::byte*>(column.mutable_data());
    for (std::size_t i = 0; i < rows.size(); ++i)
      std::memcpy(to + i * width, from + i * sizeof(Row) + offset, width);
    columns[name] = column;
  }
  return columns;
}

/// Steps the members of a batch that `ids` names, by go(batch, motions, responses), without the interpreter's
/// lock. Row i of `numbers` becomes the motion of member i, as Row::motion says. Returns the responses by
/// column.
template <class Row, class Self, class Go>
py::dict step_rows(Self& self, const Ids& ids, const Numbers& numbers, const Go& go) {
  using Motion = typename Row::Motion;
  using Response = typename Row::Response;
  if (ids.ndim() != 1 || numbers.ndim() != 2 || numbers.shape(0) != ids.shape(0) ||
      numbers.shape(1) != Row::size)
    throw bristle::Error("motions: shape (n, " + std::to_string(Row::size) +
                         ") is needed for n ids: " + Row::numbers);
  std::vector<Motion> in;
  for (py::ssize_t i = 0; i < ids.shape(0); ++i)
    in.push_back(Row::motion({ids.at(i)}, numbers.data() + i * Row::size));
  std::vector<Response> out(in.size());
  self.use([&](auto& batch) {
    const WithoutLock unlocked;
    go(batch, bristle::Span<const Motion>{in.data(), in.size()},
       bristle::Span<Response>{out.data(), out.size()});
  });
  return columns_of(out);
}

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

/// Adds the constructor of a batch, with the keywords threads and isa.
template <class Batch>
void define_constructor(py::class_<Owned<Batch>>& type, const char* doc) {
  type.def(
      py::init([](int threads, const char* isa) {
        return std::make_unique<Owned<Batch>>(bristle::BatchOptions{}.with_threads(threads).with_isa(isa));
      }),
      py::kw_only(), py::arg("threads") = 1, optional("isa"), doc);
}

/// Adds the methods save_state and restore_state, which hold the state as bytes. `refusal` follows the name
/// of the class in the error of a copy or pickle.
template <class Self>
void define_saved_state(py::class_<Self>& type, const char* saves, const char* restores,
                        const char* refusal) {
  type.def(
          "save_state",
          [](Self& self) {
            const auto state = self.use([](auto& object) {
              std::vector<std::byte> bytes(object.state_size());
              object.save_state({bytes.data(), bytes.size()});
              return bytes;
            });
            return py::bytes(reinterpret_cast<const char*>(state.data()), state.size());
          },
          saves)
      .def(
          "restore_state",
          [](Self& self, const py::bytes& state) {
            const std::string bytes = state;
            self.use([&](auto& object) {
              object.restore_state({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()});
            });
          },
          py::arg("state"), restores)
      .def(
          "__reduce__",
          [refusal](const py::object& self) -> py::object {
            throw py::type_error(std::string(Py_TYPE(self.ptr())->tp_name) + refusal);
          },
          "Raises TypeError, which says what to do instead.");
}

/// Adds the methods state_hash, save_state, restore_state and len() to a class of a batch. `argument` is the
/// name of a member's id in Python.
template <class Id, class Batch, class Count>
void define_state(py::class_<Owned<Batch>>& type, const char* argument, const Count& count) {
  using Self = Owned<Batch>;
  type.def(
      "state_hash",
      [](Self& self, const std::optional<Id>& of) {
        return self.use([&](auto& batch) { return of ? batch.state_hash(*of) : batch.state_hash(); });
      },
      optional(argument), "Of one, or of all: equal on every machine.");
  type.def("__len__", in_turn<Self>(count));
  define_saved_state(type, "The state of all as bytes.",
                     "Restores what save_state gave, in an object made in the same way. Raises "
                     "bristle.Error, state unchanged, where it does not fit.",
                     " is not copied or pickled as a whole: make another in the same way, and give its "
                     "restore_state() the bytes of save_state()");
}

}  // namespace bristle_python
