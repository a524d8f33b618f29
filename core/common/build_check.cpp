#include "bristle/build_check.hpp"

#include <string>

#include "bristle/error.hpp"

namespace bristle {

namespace {

std::string version_text(std::uint32_t number) {
  return std::to_string(number / 10000) + "." + std::to_string(number / 100 % 100) + "." +
         std::to_string(number % 100);
}

[[noreturn]] void refuse(const BuildSignature& headers, const std::string& theirs, const std::string& ours) {
  throw Error("bristle: header " + version_text(headers.version) + theirs + ", library " +
              version_text(header_build.version) + ours +
              ": compile with the headers that were installed with the library");
}

struct Option {
  const char* name;
  std::uint32_t bit;
};
constexpr Option options[] = {{"BRISTLE_WITH_DOUBLE", 1}, {"BRISTLE_WITH_TBB", 2}};

struct Size {
  const char* type;
  std::uint32_t BuildSignature::*bytes;
};
constexpr Size sizes[] = {{"Material", &BuildSignature::material_bytes},
                          {"PatchOptions", &BuildSignature::patch_options_bytes},
                          {"Motion", &BuildSignature::motion_bytes},
                          {"Response", &BuildSignature::response_bytes},
                          {"PatchInfo", &BuildSignature::patch_info_bytes},
                          {"BatchOptions", &BuildSignature::batch_options_bytes},
                          {"StepReport", &BuildSignature::step_report_bytes},
                          {"DeadlineMonitor", &BuildSignature::deadline_monitor_bytes}};

}  // namespace

void check_build(const BuildSignature& headers) {
  // Compares major and minor version only. Before 1.0 a minor version may change anything, while a patch
  // version changes neither struct sizes nor options.
  if (headers.version / 100 != header_build.version / 100) refuse(headers, "", "");
  for (const Option& option : options) {
    const bool theirs = (headers.options & option.bit) != 0;
    const bool ours = (header_build.options & option.bit) != 0;
    if (theirs == ours) continue;
    const auto with = [&](bool on) { return std::string(" with ") + option.name + (on ? " on" : " off"); };
    refuse(headers, with(theirs), with(ours));
  }
  if (headers.signature_bytes != sizeof(BuildSignature)) refuse(headers, " of another build", "");
  for (const Size& size : sizes) {
    if (headers.*size.bytes == header_build.*size.bytes) continue;
    const auto with = [&](std::uint32_t bytes) {
      return std::string(" with a ") + size.type + " of " + std::to_string(bytes) + " bytes";
    };
    refuse(headers, with(headers.*size.bytes), with(header_build.*size.bytes));
  }
}

}  // namespace bristle
