// Defines the extension module `_bristle`, which `import bristle` loads.
#include <cstring>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/products/python/module.hpp"

namespace bristle_python {

unsigned index_of(const Spelling& spelling, const std::string& name) {
  std::string known;
  cli::NameList names(spelling.names, spelling.names + spelling.count);
  for (unsigned i = 0; i < spelling.count; ++i) {
    if (name == names[i]) return i;
    known += (known.empty() ? "\"" : ", \"") + names[i] + "\"";
  }
  throw bristle::Error(std::string(spelling.what) + ": \"" + name + "\" is not one of " + known +
                       cli::meant(name, names));
}

namespace {

/// pybind11's C function through which every function of the module is called; this file calls it and
/// improves its errors.
PyCFunctionWithKeywords dispatch = nullptr;

/// Replaces pybind11's error, a list of all signatures, by one line that names the argument at fault.
void explain(py::handle function, py::handle arguments, py::handle keywords) {
  py::error_already_set error;
  const std::string text = py::cast<std::string>(py::str(error.value()));
  if (text.find("The following argument types are supported") == std::string::npos) {
    error.restore();
    return;
  }
  try {
    const py::object line = py::module_::import("bristle._calls")
                                .attr("explain")(function, text, arguments, keywords ? keywords : py::dict());
    PyErr_SetObject(PyExc_TypeError, line.ptr());
  } catch (py::error_already_set& failure) {
    failure.restore();
  }
}

/// Whether the call is __init__ of an object that has been made already. pybind11 would ignore such a call.
bool is_made_twice(PyObject* function, PyObject* arguments) {
  const auto* const record =
      static_cast<py::detail::function_record*>(PyCapsule_GetPointer(function, PyCapsule_GetName(function)));
  if (!record->is_new_style_constructor || PyTuple_GET_SIZE(arguments) == 0) return false;
  auto* const self = reinterpret_cast<py::detail::instance*>(PyTuple_GET_ITEM(arguments, 0));
  return PyObject_TypeCheck(self, reinterpret_cast<PyTypeObject*>(record->scope.ptr())) &&
         self->get_value_and_holder().instance_registered();
}

PyObject* call(PyObject* function, PyObject* arguments, PyObject* keywords) {
  if (is_made_twice(function, arguments)) {
    PyErr_Format(PyExc_TypeError, "%s(): __init__ was called on an object that is made already",
                 Py_TYPE(PyTuple_GET_ITEM(arguments, 0))->tp_name);
    return nullptr;
  }
  PyObject* const result = dispatch(function, arguments, keywords);
  if (result == nullptr && PyErr_ExceptionMatches(PyExc_TypeError) != 0)
    explain(function, arguments, keywords);
  return result;
}

/// Makes a function of pybind11 explain its errors. Also removes the line "name(*args, **kwargs)" that
/// pybind11 writes above the signatures of overloads.
void finish_function(py::handle member) {
  const py::handle function = py::detail::get_function(member);
  if (!function || !PyCFunction_Check(function.ptr())) return;
  PyMethodDef& method = *reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
  // Skips __new__, whose self is a class, because only functions and methods explain their errors.
  if (method.ml_flags != (METH_VARARGS | METH_KEYWORDS) || PyType_Check(PyCFunction_GET_SELF(function.ptr())))
    return;
  const auto ours = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&call));
  if (method.ml_meth == ours) return;
  dispatch = reinterpret_cast<PyCFunctionWithKeywords>(reinterpret_cast<void (*)()>(method.ml_meth));
  method.ml_meth = ours;
  const std::string head = std::string(method.ml_name) + "(*args, **kwargs)\nOverloaded function.\n\n";
  char* const doc = const_cast<char*>(method.ml_doc);  // memory of pybind11's own, which it frees
  if (doc != nullptr && std::strncmp(doc, head.c_str(), head.size()) == 0)
    std::memmove(doc, doc + head.size(), std::strlen(doc + head.size()) + 1);
}

/// Makes the base of all classes, which pybind11's modules share, raise TypeError where an object is made of
/// it. pybind11 ends the process instead, also for `x.__reduce__()`, which calls it.
void guard_base() {
  static newfunc make = nullptr;
  auto* const base = reinterpret_cast<PyTypeObject*>(py::detail::get_internals().instance_base);
  make = base->tp_new;
  base->tp_new = [](PyTypeObject* type, PyObject* arguments, PyObject* keywords) -> PyObject* {
    if (!py::detail::all_type_info(type).empty()) return make(type, arguments, keywords);
    PyErr_Format(PyExc_TypeError, "cannot make a '%s'", type->tp_name);
    return nullptr;
  };
}

/// Makes a class that defines no copying or pickling raise TypeError on an attempt.
void refuse_copies(py::handle type) {
  if (type.attr("__dict__").contains("__reduce__")) return;
  type.attr("__reduce__") = py::cpp_function(
      [](const py::object& self) -> py::object {
        throw py::type_error(std::string(Py_TYPE(self.ptr())->tp_name) + " cannot be copied or pickled");
      },
      py::name("__reduce__"), py::is_method(type), "Raises TypeError.");
}

/// Makes a class without a constructor say in its error where its objects come from.
void explain_construction(py::handle type) {
  initproc& init = reinterpret_cast<PyTypeObject*>(type.ptr())->tp_init;
  if (init != &py::detail::pybind11_object_init) return;
  init = [](PyObject* self, PyObject*, PyObject*) {
    PyErr_Format(PyExc_TypeError, "cannot make a '%s': functions and methods return such objects",
                 Py_TYPE(self)->tp_name);
    return -1;
  };
}

/// Finishes the functions of the module, and the methods and properties of its classes.
void finish_functions(py::handle owner) {
  for (const auto& [name, member] : py::dict(owner.attr("__dict__"))) {
    if (PyObject_TypeCheck(member.ptr(), py::detail::get_internals().default_metaclass)) {
      refuse_copies(member);
      explain_construction(member);
      finish_functions(member);
    } else if (py::isinstance<py::staticmethod>(member)) {
      finish_function(member.attr("__func__"));
    } else if (PyObject_TypeCheck(member.ptr(), &PyProperty_Type)) {
      finish_function(member.attr("fget"));
      finish_function(member.attr("fset"));
    } else {
      finish_function(member);
    }
  }
}

}  // namespace
}  // namespace bristle_python

// Defines the extension module. Its classes say that they belong to the package `bristle`
// (package/__init__.py), because pickles and messages name the package.
PYBIND11_MODULE(_bristle, module) {
  using namespace bristle_python;
  const py::object own_name = module.attr("__name__");
  module.attr("__name__") = "bristle";
  module.doc() =
      "Brush-model friction: patches of elastic bristles that stick, bend and snap, stepped by SIMD kernels. "
      "SI units. Forces act on the moving body.";
  module.attr("__version__") = bristle::library_version();
  guard_base();
  py::register_exception<bristle::Error>(module, "Error", PyExc_ValueError);
  define_materials(module);
  define_options(module);
  define_arrays(module);
  define_batch(module);
  define_beds(module);
  define_extended(module);
  define_joints(module);
  define_keyed(module);
  define_monitor(module);
#if BRISTLE_PYTHON_TOOLS
  define_tools(module);
#endif
  module.def(
      "instruction_sets",
      [] {
        py::dict sets;
        for (const bristle::IsaInfo& isa : bristle::instruction_sets()) sets[isa.name] = isa.usable;
        return sets;
      },
      "Instruction sets of this build, best first, and whether this machine runs them.");
  finish_functions(module);
  module.attr("__name__") = own_name;
}
