// Chooses the kernels (instruction set) of a batch from its options, and checks its number of threads.
#pragma once

#include <cstdlib>
#include <cstring>
#include <string>

#include "bristle/error.hpp"
#include "core/common/check_fields.hpp"
#include "core/kernel_table.hpp"

namespace bristle::detail {

/// Looks up the kernels by the name `wanted`. Without a name, takes those that the environment variable
/// BRISTLE_ISA names; without that, the fastest that this machine supports. Throws Error for an unknown or
/// unsupported name.
inline const KernelTable& choose_kernels(const char* wanted) {
  int count = 0;
  const KernelEntry* entries = kernel_entries(&count);
  if (wanted == nullptr || *wanted == 0) wanted = std::getenv("BRISTLE_ISA");
  const bool any = wanted == nullptr || *wanted == 0;
  std::string known;
  for (int i = 0; i < count; ++i) {
    if (any ? entries[i].usable() : std::strcmp(wanted, entries[i].table->name) == 0) {
      if (entries[i].usable()) return *entries[i].table;
      throw Error(std::string("BatchOptions: isa = ") + wanted + "; this machine does not run it");
    }
    known += (i ? ", " : "") + std::string(entries[i].table->name);
  }
  throw Error(std::string("BatchOptions: isa = ") + (wanted ? wanted : "") + "; this build has " + known);
}

/// Returns the number of threads, or throws Error.
inline int check_threads(const BatchOptions& options) {
  require_fields("BatchOptions", options);
  return options.threads;
}

}  // namespace bristle::detail
