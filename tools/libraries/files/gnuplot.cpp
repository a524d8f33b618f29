#include "tools/libraries/files/gnuplot.hpp"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

namespace fs = std::filesystem;

// Returns the folder of gnuplot scripts: that in the environment variable BRISTLE_PLOTS, otherwise the one
// installed beside the program, otherwise the one of the sources. Its path is relative to the program, so
// that both may be moved together.
fs::path plots_folder() {
  if (const char* folder = std::getenv("BRISTLE_PLOTS")) return folder;
  std::error_code none;
  const fs::path program = platform::program_folder();
  const fs::path installed = (program / BRISTLE_PLOTS_INSTALLED).lexically_normal();
  return fs::exists(installed, none) ? installed : (program / BRISTLE_PLOTS_IN_SOURCES).lexically_normal();
}

}  // namespace

std::string gnuplot_string(std::string_view text) {
  // Writes all but harmless characters in octal. A line end would end gnuplot's command, and a backquote
  // would begin one of the shell.
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
  std::FILE* const gnuplot = ::popen("command -v gnuplot >/dev/null || exit 127; exec gnuplot", "we");
  // Ignores SIGPIPE, so that a write to a gnuplot that has ended fails instead of ending this program.
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  if (gnuplot != nullptr) std::fwrite(script.data(), 1, script.size(), gnuplot);
  const int status = gnuplot != nullptr ? ::pclose(gnuplot) : -1;
  std::signal(SIGPIPE, before);
  if (status == 0) return;
  throw UserError(
      WIFEXITED(status) && WEXITSTATUS(status) == 127
          ? fmt::format("{}: gnuplot is not installed (Debian: gnuplot-nox); --csv works without", option)
          : fmt::format("{}: gnuplot failed", option));
}

std::string find_plot_script(const std::string& file, const char* option) {
  run_gnuplot("", option);  // says before the work if gnuplot is not there
  const std::string script = (plots_folder() / file).string();
  if (!fs::exists(script))
    throw UserError(
        fmt::format("{}: {} does not exist; set BRISTLE_PLOTS to the folder of the scripts", option, script));
  return script;
}

void draw_csv(const std::string& script, const std::string& csv, const std::string& picture, bool vectors,
              const std::string& settings, const char* option) {
  run_gnuplot(fmt::format("folder = {}\npng = {}\nsvg = {}\n{}csv = {}\nload {}\n",
                          gnuplot_file(fs::path(script).parent_path().string()), gnuplot_file(picture),
                          vectors ? 1 : 0, settings, gnuplot_file(csv), gnuplot_file(script)),
              option);
}

std::string temporary_csv(const char* option) {
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  if (error) throw UserError(fmt::format("{}: the folder of TMPDIR: {}", option, error.message()));
  return (folder / fmt::format("bristle_{}.csv", platform::process_number())).string();
}

}  // namespace cli
