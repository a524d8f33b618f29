// Declarations shared by the sources of the Python module.
#pragma once

#include <unistd.h>

#include <string>
#include <type_traits>
#include <utility>

#ifdef __GLIBCXX__
#include <cxxabi.h>
#endif

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <bristle/bristle.hpp>
#include <bristle/fields.hpp>

namespace bristle_python {

namespace py = pybind11;

template <class T, class... Listed>
inline constexpr bool is_one_of = (std::is_same_v<T, Listed> || ...);

/// Whether Python's `T.__new__(T)` can make an object of T that has no C++ object in it, which calls must
/// refuse. For a class that this list lacks, set it before the py::class_ of T.
template <class T>
inline constexpr bool is_module_class =
    is_one_of<T, bristle::BedMaterial, bristle::BedShape, bristle::Coefficients, bristle::DeadlineMonitor,
              bristle::JointMaterial, bristle::Lay, bristle::Material, bristle::Outline, bristle::PatchGroup,
              bristle::PatchOptions, bristle::SnapLength, bristle::StepReport>;

/// Returns an argument that is None where it is left out.
inline py::arg_v optional(const char* name) { return py::arg(name) = py::none(); }

/// Names of the values of an enumeration, in their order, and the word for them in errors.
struct Spelling {
  const char* what;
  const char* const* names;
  unsigned count;
};
template <unsigned count>
constexpr Spelling spelled(const char* what, const char* const (&names)[count]) {
  return {what, names, count};
}
inline constexpr const char* outline_pressure_names[] = {"uniform", "hertz"};

/// Returns how Python spells an enumeration: its values are strings there.
constexpr Spelling spelling(bristle::SnapLaw) { return spelled("law", bristle::snap_law_names); }
constexpr Spelling spelling(bristle::SnapRule) { return spelled("snap_rule", bristle::snap_rule_names); }
constexpr Spelling spelling(bristle::DamperDecay) {
  return spelled("damper_decay", bristle::damper_decay_names);
}
constexpr Spelling spelling(bristle::AgeingForm) {
  return spelled("ageing_form", bristle::ageing_form_names);
}
constexpr Spelling spelling(bristle::Outputs) { return spelled("outputs", bristle::outputs_names); }
constexpr Spelling spelling(bristle::Precision) { return spelled("precision", bristle::precision_names); }
constexpr Spelling spelling(bristle::Population) { return spelled("population", bristle::population_names); }
constexpr Spelling spelling(bristle::Pressure) { return spelled("pressure", outline_pressure_names); }
constexpr Spelling spelling(bristle::BedShape::Kind) { return spelled("kind", bristle::bed_kind_names); }
constexpr Spelling spelling(bristle::BedPressure) { return spelled("pressure", bristle::bed_pressure_names); }
constexpr Spelling spelling(bristle::BedGrowth) { return spelled("law", bristle::bed_growth_names); }

/// Returns the index of a name. Throws bristle::Error that lists the allowed names.
unsigned index_of(const Spelling& spelling, const std::string& name);

/// Returns the numpy dtype with the memory layout of bristle::Motion, so that a step reads arrays without a
/// copy. That of bristle::Response is py::dtype::of<bristle::Response>().
const py::dtype& motion_dtype();

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

void define_materials(py::module_& module);
void define_options(py::module_& module);
void define_arrays(py::module_& module);
void define_batch(py::module_& module);
void define_beds(py::module_& module);
void define_extended(py::module_& module);
void define_joints(py::module_& module);
void define_keyed(py::module_& module);
void define_monitor(py::module_& module);
/// Adds scenes, fitting and experiments to the module, if the build has their libraries.
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

/// Converts ids to int and back.
template <class Id>
struct type_caster<Id, std::enable_if_t<bristle_python::is_one_of<Id, bristle::PatchId, bristle::BedId>>> {
  PYBIND11_TYPE_CASTER(Id, const_name("int"));
  bool load(handle source, bool convert) {
    make_caster<std::uint64_t> number;
    if (!number.load(source, convert)) return false;
    value = {cast_op<std::uint64_t>(number)};
    return true;
  }
  static handle cast(const Id& id, return_value_policy policy, handle parent) {
    return make_caster<std::uint64_t>::cast(id.value, policy, parent);
  }
};

/// Converts enumerations to str and back.
template <class E>
struct type_caster<E, std::enable_if_t<std::is_same_v<decltype(bristle_python::spelling(std::declval<E>())),
                                                      bristle_python::Spelling>>> {
  PYBIND11_TYPE_CASTER(E, const_name("str"));
  bool load(handle source, bool) {
    if (!isinstance<str>(source)) return false;
    value = static_cast<E>(
        bristle_python::index_of(bristle_python::spelling(E{}), pybind11::cast<std::string>(source)));
    return true;
  }
  static handle cast(E value, return_value_policy, handle) {
    return str(bristle_python::spelling(value).names[static_cast<unsigned>(value)]).release();
  }
};

/// Lets structs with ids and flags be columns of numpy arrays.
template <>
struct npy_format_descriptor<bristle::PatchId> : npy_format_descriptor<std::uint64_t> {};

}  // namespace pybind11::detail

template <>
struct pybind11::format_descriptor<bristle::PatchId> : pybind11::format_descriptor<std::uint64_t> {};
