// Defines the extension module, which `import bristle` loads.
#include <cstring>

#include "tools/products/python/module.hpp"

namespace bristle_python {
namespace {

/// C function of pybind11 through which every function of the module is called.
PyCFunctionWithKeywords dispatch = nullptr;

/// Replaces pybind11's error, a list of all signatures, by one line that names the argument that does not
/// fit.
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

PyObject* call(PyObject* function, PyObject* arguments, PyObject* keywords) {
  PyObject* const result = dispatch(function, arguments, keywords);
  if (result == nullptr && PyErr_ExceptionMatches(PyExc_TypeError) != 0)
    explain(function, arguments, keywords);
  return result;
}

/// Makes a function of pybind11 explain its errors. Removes the line "name(*args, **kwargs)" that pybind11
/// writes above the signatures of overloads.
void finish_function(py::handle member) {
  const py::handle function = py::detail::get_function(member);
  if (!function || !PyCFunction_Check(function.ptr())) return;
  PyMethodDef& method = *reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
  // Skips __new__, whose self is a class: only functions and methods explain their errors.
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

/// Finishes the functions of the module, and the methods and properties of its classes.
void finish_functions(py::handle owner) {
  for (const auto& [name, member] : py::dict(owner.attr("__dict__"))) {
    if (PyObject_TypeCheck(member.ptr(), py::detail::get_internals().default_metaclass)) {
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
// (package/__init__.py), since pickles and messages name that.
PYBIND11_MODULE(_bristle, module) {
  using namespace bristle_python;
  const py::object own_name = module.attr("__name__");
  module.attr("__name__") = "bristle";
  module.doc() =
      "Brush-model friction: patches of elastic bristles that stick, bend and snap, stepped by SIMD kernels. "
      "SI units. Forces act on the moving body.";
  module.attr("__version__") = bristle::library_version();
  py::register_exception<bristle::Error>(module, "Error", PyExc_ValueError);
  define_materials(module);
  define_options(module);
  define_arrays(module);
  define_batch(module);
  define_beds(module);
  define_extended(module);
  define_joints(module);
  define_monitor(module);
  define_tools(module);
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
