// Binds PatchOptions and Lay.
#include "tools/products/python/keyword_class.hpp"

namespace bristle_python {

void define_options(py::module_& module) {
  KeywordClass<bristle::Lay>(
      module, "Lay", "Direction of a surface that resists differently along and across it, and to and fro.")
      .listed_fields()
      .done();
  KeywordClass<bristle::PatchOptions>(
      module, "PatchOptions",
      "How a patch is simulated. What it does not ask for is neither computed nor stored.")
      .listed_fields()
      .done();
}

}  // namespace bristle_python
