#include "tools/sweep/dask.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"
#include "tools/run/paced_clock.hpp"

namespace cli {
namespace {

/// A file that only we read, gone at the end.
class Request {
 public:
  explicit Request(const std::string& text) {
    path_ = (std::filesystem::temp_directory_path() / "bristle_sweep_XXXXXX").string();
    const int file = mkstemp(path_.data());
    if (file < 0) throw UserError(fmt::format("{}: cannot be made", path_));
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(fdopen(file, "w"), &std::fclose);
    if (!out || std::fwrite(text.data(), 1, text.size(), out.get()) != text.size() ||
        std::fflush(out.get()) != 0)
      throw UserError(fmt::format("{}: cannot be written", path_));
  }
  ~Request() { unlink(path_.c_str()); }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// The Python module of a build folder lies beside the program.
std::string python_path() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path beside = self.parent_path() / "python";
  if (error || !std::filesystem::exists(beside / "bristle")) return {};
  const char* given = std::getenv("PYTHONPATH");
  return "PYTHONPATH=" + quoted(given ? std::string(given) + ':' + beside.string() : beside.string()) + ' ';
}

/// The system's has its packages, numpy and distributed among them; another may come first in PATH.
const char* interpreter() {
  if (const char* given = std::getenv("BRISTLE_PYTHON")) return given;
  return access("/usr/bin/python3", X_OK) == 0 ? "/usr/bin/python3" : "python3";
}

std::string command_of(const Request& request) {
  return python_path() + "exec " + quoted(interpreter()) + " -m bristle.sweep " + quoted(request.path());
}

}  // namespace

void run_rows_by_dask(const Study& study, const std::vector<std::uint64_t>& indices,
                      const std::string& address, const std::string& isa, const RowDone& done) {
  const nlohmann::json request = {{"recipe", study.recipe()},
                                  {"study", study.hash()},
                                  {"indices", indices},
                                  {"address", address},
                                  {"isa", isa}};
  const Request file(request.dump());
  std::FILE* pipe = popen(command_of(file).c_str(), "r");
  if (pipe == nullptr) throw UserError("--dask: python3 cannot be started");
  char* line = nullptr;
  std::size_t room = 0;
  std::exception_ptr failure;
  while (!failure) {
    const ssize_t length = getline(&line, &room, pipe);
    if (length < 0) {
      if (errno == EINTR && !stop_requested() && !std::feof(pipe)) {
        std::clearerr(pipe);
        continue;
      }
      break;
    }
    try {
      std::string row(line, static_cast<std::size_t>(length));
      if (!row.empty() && row.back() == '\n') row.pop_back();
      if (!row.empty() && row.front() == '[') done(row);
    } catch (...) {
      failure = std::current_exception();
    }
  }
  std::free(line);
  const int status = pclose(pipe);
  if (failure) std::rethrow_exception(failure);
  if (stop_requested()) throw SweepStopped();
  if (status == 0) return;
  throw UserError(fmt::format(
      "--dask {}: python3 -m bristle.sweep ended before its rows were done; it needs the Python module of "
      "bristle (PYTHONPATH) and Debian's python3-distributed, or name another interpreter in "
      "BRISTLE_PYTHON; rows that are in the journal are kept",
      address));
}

}  // namespace cli
