// Defines the extension module, which `import bristle` loads.
#include "tools/python/module.hpp"

// Defines the extension module. Its classes say that they belong to the package `bristle`
// (package/__init__.py), since pickles and messages name that.
PYBIND11_MODULE(_bristle, module) {
  using namespace bristle_python;
  const py::object own_name = module.attr("__name__");
  module.attr("__name__") = "bristle";
  module.doc() =
      "Brush-model friction: patches of elastic bristles that stick, bend and snap, stepped by SIMD kernels. "
      "SI units. "
      "Forces act on the moving body.";
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
  module.attr("__name__") = own_name;
}
