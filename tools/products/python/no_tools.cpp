// Stands in for scenes, fitting and experiments in builds without their libraries.
#include "tools/products/python/module.hpp"

namespace bristle_python {

void define_tools(py::module_& module) {
  // Raises the error for missing names in the module's __getattr__, which Python calls for names that the
  // module does not have.
  module.def("__getattr__", [](const std::string& name) -> py::object {
    for (const char* absent : {"Scene", "SceneRun", "run_scene", "FitEstimate", "FitResult", "fit",
                               "experiment", "sweep", "SweepTable"}) {
      if (name == absent)
        throw py::attribute_error("bristle." + name +
                                  " is not in this build of the module: build it with BRISTLE_BUILD_TOOLS=ON "
                                  "and the packages of the "
                                  "command line (CMake names those that are missing)");
    }
    throw py::attribute_error("module 'bristle' has no attribute '" + name + "'");
  });
}

}  // namespace bristle_python
