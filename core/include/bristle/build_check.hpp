// Detects at start-up that the headers a program was compiled with and the library it found do not belong
// together, and names the difference. The constructor of PatchBatch makes this check; a program need not call
// it.
#pragma once

#include <cstdint>

#include "bristle/config.hpp"
#include "bristle/deadline_monitor.hpp"
#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/version.hpp"

namespace bristle {

/// Properties that headers and library must share: major and minor version, options, sizes in bytes.
struct BuildSignature {
  std::uint32_t signature_bytes;
  std::uint32_t version;  ///< value of BRISTLE_VERSION_NUMBER in the headers
  std::uint32_t options;  ///< value of BRISTLE_BUILD_OPTIONS in the headers
  std::uint32_t material_bytes, patch_options_bytes, motion_bytes, response_bytes, patch_info_bytes;
  std::uint32_t batch_options_bytes, step_report_bytes, deadline_monitor_bytes;
};

/// Signature of the headers that this code is compiled with. Not inline: library and program each have their
/// own, which are compared.
constexpr BuildSignature header_build = {
    sizeof(BuildSignature), BRISTLE_VERSION_NUMBER, BRISTLE_BUILD_OPTIONS,  sizeof(Material),
    sizeof(PatchOptions),   sizeof(Motion),         sizeof(Response),       sizeof(PatchInfo),
    sizeof(BatchOptions),   sizeof(StepReport),     sizeof(DeadlineMonitor)};

/// Throws bristle::Error that names the difference, e.g. "header 0.1.0 with BRISTLE_WITH_TBB off,
/// library 0.1.0 with BRISTLE_WITH_TBB on". Thread-safe. A program that makes materials long before its first
/// PatchBatch may call it first.
BRISTLE_API void check_build(const BuildSignature& headers = header_build);

inline PatchBatch::PatchBatch(const BatchOptions& options) : PatchBatch(options, header_build) {}

}  // namespace bristle
