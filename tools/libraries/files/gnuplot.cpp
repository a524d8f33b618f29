#include "tools/libraries/files/gnuplot.hpp"

#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {

std::string gnuplot_string(std::string_view text) {
  // Writes all but harmless characters in octal: a line end would end gnuplot's command, a backquote begin
  // one of the shell.
  std::string quoted = "\"";
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view(" ./_-").find(c) != std::string_view::npos;
    quoted += plain ? std::string(1, c) : fmt::format("\\{:03o}", static_cast<unsigned char>(c));
  }
  return quoted + '"';
}

std::string gnuplot_file(const std::string& path) {
  return gnuplot_string(std::filesystem::absolute(path).string());
}

void run_gnuplot(std::string_view script, const char* option) {
  const std::optional<int> status = platform::feed_program("gnuplot", script);
  if (status == 0) return;
  throw UserError(
      status == 127
          ? fmt::format("{}: gnuplot is not installed (Debian: gnuplot-nox); --csv works without", option)
          : fmt::format("{}: gnuplot failed", option));
}

}  // namespace cli
