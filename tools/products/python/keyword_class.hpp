// Binds a struct of plain fields as a Python class with keyword arguments, attributes, == and repr.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <bristle/fields.hpp>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/products/python/module.hpp"

namespace bristle_python {

/// Returns the help text of a field of numbers: unit and meaning.
inline std::string help_of(const bristle::AboutField& about) {
  return (*about.unit != '\0' ? std::string(about.unit) + ". " : "") + about.text;
}

/// Returns a value as Python code. A number within four rounding errors of one with at most twelve digits is
/// written as the short one: 2e-06, not 2.0000000000000003e-06.
inline std::string code_of(const py::object& value) {
  py::object shown = value;
  if (py::isinstance<py::float_>(value)) {
    const auto number = py::cast<double>(value);
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.12g", number);
    const double rounded = std::strtod(digits, nullptr);
    const double rounding_errors = 4.0 * std::numeric_limits<double>::epsilon() * std::abs(number);
    if (std::abs(rounded - number) <= rounding_errors) shown = py::float_(rounded);
  }
  return py::cast<std::string>(py::repr(shown));
}

template <class T>
class KeywordClass {
 public:
  KeywordClass(py::module_& module, const char* name, const char* doc)
      : type(module, name, doc), name_(name) {}

  /// Adds a field whose value is read by `get` and written by `set`.
  template <class Get, class Set>
  KeywordClass& property(const char* name, Get get, Set set, const char* doc) {
    type.def_property(name, get, set, doc);
    fields_.emplace_back(name);
    return *this;
  }
  template <class Member>
  KeywordClass& field(const char* name, Member T::*member, const char* doc) {
    // Returns the field by value. A reference would change later, together with the field.
    return property(
        name, [=](const T& self) { return self.*member; },
        [=](T& self, const Member& value) { self.*member = value; }, doc);
  }
  template <class Number, std::size_t n>
  KeywordClass& field(const char* name, Number (T::*member)[n], const char* doc) {
    return property(
        name,
        [=](const T& self) {
          py::tuple numbers(n);
          for (std::size_t i = 0; i < n; ++i) numbers[i] = (self.*member)[i];
          return numbers;
        },
        [=](T& self, const std::array<Number, n>& value) { std::copy_n(value.data(), n, self.*member); },
        doc);
  }
  /// Adds to the Python class all fields that bristle/fields.hpp lists for the struct, but for a bed's list.
  KeywordClass& listed_fields() {
    bristle::for_each_field<T>([&](const auto& listed) {
      using Value = std::decay_t<decltype(std::declval<T>().*listed.member)>;
      const bristle::AboutField& about = listed.about;
      if constexpr (std::is_enum_v<Value>) {
        std::string doc;
        for (unsigned i = 0; i < about.name_count; ++i)
          doc += (i == 0                     ? "\""
                  : i + 1 < about.name_count ? ", \""
                                             : " or \"") +
                 std::string(about.names[i]) + "\"";
        doc += std::string(": ") + about.text + ".";
        field(listed.name, listed.member, doc.c_str());
      } else if constexpr (!std::is_same_v<Value, std::vector<bristle::BedCell>>) {
        field(listed.name, listed.member, help_of(about).c_str());
      }
    });
    return *this;
  }
  /// Returns the fields with types and defaults, as help() shows them: "a: float = 1.0, b: str = 'x'".
  std::string keywords() const {
    const py::object by_default = py::cast(T{});
    std::string all;
    for (const std::string& field : fields_) {
      const py::object value = by_default.attr(field.c_str());
      all += (all.empty() ? "" : ", ") + field + ": " + Py_TYPE(value.ptr())->tp_name + " = " +
             py::cast<std::string>(py::repr(value));
    }
    return all;
  }
  /// Adds constructor, comparison and repr. Call it after all fields. Python: T(a=1, b=2); fields left out
  /// keep their defaults.
  void done() {
    const auto make = [name = name_, fields = fields_](const py::dict& given) {
      T value;
      const py::object self = py::cast(&value, py::return_value_policy::reference);
      for (const auto& [key, item] : given) {
        const std::string parameter = py::cast<std::string>(key);
        if (std::find(fields.begin(), fields.end(), parameter) == fields.end())
          throw py::type_error(name + "() has no parameter '" + parameter + "'" +
                               cli::meant(parameter, fields));
        py::setattr(self, key, item);
      }
      return value;
    };
    {
      py::options options;
      options.disable_function_signatures();
      const std::string signature = "__init__(self: bristle." + name_ + ", *, " + keywords() + ") -> None";
      type.def(py::init([make](const py::kwargs& given) { return make(given); }), signature.c_str());
    }
    // Copies and pickles an object as a call with its fields by name, so that a later version may have more
    // fields.
    type.def("__reduce__", [fields = fields_](const py::object& self) {
      py::dict given;
      for (const std::string& field : fields) given[py::str(field)] = self.attr(field.c_str());
      const py::object partial = py::module_::import("functools").attr("partial");
      return py::make_tuple(partial(py::type::of(self), **given), py::tuple());
    });
    // Prints an object as Python code with those of its fields that differ from their defaults.
    type.def("__repr__", [name = name_, fields = fields_](const py::object& self) {
      const py::object usual = py::cast(T{});
      std::string text;
      for (const std::string& field : fields) {
        const py::object value = self.attr(field.c_str());
        if (value.equal(usual.attr(field.c_str()))) continue;
        text += (text.empty() ? "" : ", ") + field + "=" + code_of(value);
      }
      return name + "(" + text + ")";
    });
    type.def("__eq__", [fields = fields_](const py::object& self, const py::object& other) {
      if (!py::isinstance<T>(other)) return false;
      for (const std::string& field : fields) {
        if (!self.attr(field.c_str()).equal(other.attr(field.c_str()))) return false;
      }
      return true;
    });
    type.attr("__hash__") = py::none();  // == without a hash: Python hashes only immutable objects
  }

  py::class_<T> type;

 private:
  std::string name_;
  std::vector<std::string> fields_;
};

}  // namespace bristle_python
