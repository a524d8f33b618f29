// Declarations shared by the sources of the Python module.
#pragma once

#include <unistd.h>

#include <atomic>
#include <string>
#include <type_traits>
#include <utility>

#ifdef __GLIBCXX__
#include <cxxabi.h>
#endif

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <bristle/bristle.hpp>

namespace bristle_python {

namespace py = pybind11;

/// Whether Python's `T.__new__(T)` can make an object of T that has no C++ object in it, which calls must
/// refuse. Set it before the py::class_ of T.
template <class T>
inline constexpr bool is_module_class = false;
template <>
inline constexpr bool is_module_class<bristle::BedMaterial> = true;
template <>
inline constexpr bool is_module_class<bristle::BedShape> = true;
template <>
inline constexpr bool is_module_class<bristle::Coefficients> = true;
template <>
inline constexpr bool is_module_class<bristle::DeadlineMonitor> = true;
template <>
inline constexpr bool is_module_class<bristle::JointMaterial> = true;
template <>
inline constexpr bool is_module_class<bristle::Lay> = true;
template <>
inline constexpr bool is_module_class<bristle::Material> = true;
template <>
inline constexpr bool is_module_class<bristle::Outline> = true;
template <>
inline constexpr bool is_module_class<bristle::PatchOptions> = true;
template <>
inline constexpr bool is_module_class<bristle::SnapLength> = true;
template <>
inline constexpr bool is_module_class<bristle::PatchGroup> = true;
template <>
inline constexpr bool is_module_class<bristle::StepReport> = true;

/// Return numpy dtypes with the memory layout of bristle::Motion and bristle::Response, so that a step reads
/// and writes arrays without a copy.
const py::dtype& motion_dtype();
const py::dtype& response_dtype();

/// Return numpy record arrays of `size` elements, whose columns can be read by name or attribute.
py::array new_motions(py::ssize_t size);
py::array new_responses(py::ssize_t size);
/// Objects of classes that are written in Python, as C++ types, so that signatures can name these classes.
struct ResponseArray : py::object {
  explicit ResponseArray(py::object array) : py::object(std::move(array)) {}
};
struct StatusFlags : py::object {
  explicit StatusFlags(py::object flags) : py::object(std::move(flags)) {}
};
/// Sets outputs that the patch does not compute to NaN, which they have in a new array.
void forget_what_was_not_asked_for(bristle::Response& response, bristle::Outputs outputs) noexcept;

/// Calls `take_lock`, which waits for the interpreter's lock. When the interpreter ends, Python up to 3.13
/// unwinds a daemon thread that waits for the lock. Unwinding would run destructors that need it, so the
/// thread sleeps here instead, until the process ends.
template <class TakeLock>
void take_lock_or_sleep(const TakeLock& take_lock) noexcept {
#ifdef __GLIBCXX__
  try {
    take_lock();
  } catch (abi::__forced_unwind&) {
    for (;;) ::pause();
  }
#else
  take_lock();
#endif
}

/// Releases Python's lock while this guard lives, so that other Python threads run meanwhile.
class WithoutLock {
 public:
  WithoutLock() : thread_(PyEval_SaveThread()) {}
  ~WithoutLock() {
    take_lock_or_sleep([this] { PyEval_RestoreThread(thread_); });
  }
  WithoutLock(const WithoutLock&) = delete;
  WithoutLock& operator=(const WithoutLock&) = delete;

  /// Calls `use` while holding the interpreter's lock, on a thread that has released it.
  template <class Use>
  void with_lock(const Use& use) {
    struct Release {
      WithoutLock& lock;
      ~Release() { lock.thread_ = PyEval_SaveThread(); }
    };
    take_lock_or_sleep([this] { PyEval_RestoreThread(thread_); });
    const Release release{*this};
    use();
  }

 private:
  PyThreadState* thread_;
};

/// Throws bristle::Error if an array that a step writes shares memory with another array of the step, because
/// the step would read what it has overwritten. Neither array may have gaps.
void refuse_overlap(const char* written, const py::array& array, const char* other,
                    const py::array& other_array);

/// Marks an object as in use while this guard lives, because only one Python thread at a time may use it (a
/// step releases the interpreter's lock). Throws bristle::Error with the text `refusal` if another thread is
/// using it.
class OneThread {
 public:
  OneThread(std::atomic<bool>& busy, const char* refusal) : busy_(busy) {
    if (busy_.exchange(true)) throw bristle::Error(refusal);
  }
  ~OneThread() { busy_.store(false); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  std::atomic<bool>& busy_;
};

void define_materials(py::module_& module);
void define_options(py::module_& module);
void define_arrays(py::module_& module);
void define_batch(py::module_& module);
void define_beds(py::module_& module);
void define_extended(py::module_& module);
void define_joints(py::module_& module);
void define_keyed(py::module_& module);
void define_monitor(py::module_& module);
/// Adds scenes, fitting and experiments to the module, if the build has their libraries; otherwise their
/// names, which raise an error with the reason.
void define_tools(py::module_& module);

}  // namespace bristle_python

namespace pybind11::detail {

/// Name the types in help().
template <>
struct handle_type_name<bristle_python::ResponseArray> {
  static constexpr auto name = const_name("bristle.Responses");
};
template <>
struct handle_type_name<bristle_python::StatusFlags> {
  static constexpr auto name = const_name("bristle.Status");
};

/// Refuses a Python object that __new__ made without its C++ object, since its memory is uninitialized.
template <class T>
class type_caster<T, std::enable_if_t<bristle_python::is_module_class<T>>> : public type_caster_base<T> {
 public:
  bool load(handle source, bool convert) { return this->template load_impl<type_caster>(source, convert); }
  void load_value(value_and_holder&& object) {
    if (object.value_ptr() == nullptr) {
      const PyTypeObject* type = object.type != nullptr ? object.type->type : this->typeinfo->type;
      throw type_error(std::string(type->tp_name) + ": __init__ was not called on this object");
    }
    type_caster_base<T>::load_value(std::move(object));
  }
};

}  // namespace pybind11::detail
