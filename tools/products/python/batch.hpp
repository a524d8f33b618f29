// The class PatchBatch in Python, to which several files add methods.
#pragma once

#include "tools/products/python/owned.hpp"

namespace bristle_python {

using Batch = Owned<bristle::PatchBatch>;

/// Adds PatchGroup, and the methods of groups to PatchBatch.
void define_groups(py::module_& module, py::class_<Batch>& batch);

}  // namespace bristle_python
