// The class PatchBatch in Python, to which several files add methods.
#pragma once

#include "tools/products/python/owned.hpp"

namespace bristle_python {

using Batch = Owned<bristle::PatchBatch>;

/// Adds the class PatchGroup, and to PatchBatch the methods for groups.
void define_groups(py::module_& module, py::class_<Batch>& batch);

}  // namespace bristle_python
