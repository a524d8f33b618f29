#include "tools/files/output_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

namespace fs = std::filesystem;

/// Names of unfinished output files, which a signal handler deletes. A handler may neither lock nor allocate,
/// so they are C strings in an array of fixed size; each string is owned by an OutputFile.
std::array<std::atomic<const char*>, 64> unfinished;

extern "C" void remove_unfinished(int signal_number) {
  for (const auto& name : unfinished)
    if (const char* path = name.load()) ::unlink(path);
  ::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

constexpr int ending[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};

/// Installs the handler that deletes unfinished files, for ending signals that have the default action.
void remove_on_signals() {
  for (const int number : ending) {
    struct sigaction now;
    if (::sigaction(number, nullptr, &now) == 0 && now.sa_handler == SIG_DFL)
      ::signal(number, &remove_unfinished);
  }
}

/// Blocks signals while it lives, so that none arrives between the creation of a file and the entry of its
/// name in the list of files to delete.
class HeldSignals {
 public:
  HeldSignals() {
    sigset_t held;
    ::sigemptyset(&held);
    for (const int number : ending) ::sigaddset(&held, number);
    ::pthread_sigmask(SIG_BLOCK, &held, &before_);
  }
  ~HeldSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

 private:
  sigset_t before_;
};

void note_unfinished(const char* name) {
  for (auto& place : unfinished) {
    const char* none = nullptr;
    if (place.compare_exchange_strong(none, name)) return;
  }
}

void forget_unfinished(const char* name) {
  for (auto& place : unfinished) {
    const char* held = name;
    if (place.compare_exchange_strong(held, nullptr)) return;
  }
}

/// Opens an output that is no regular file. ENXIO means a FIFO without a reader, for which it waits.
int open_special(const std::string& path) {
  constexpr int pause_ms = 20, patience_ms = 1000;  // time between trials, and time until a message, ms
  int file = -1;
  for (int waited = 0; waited < patience_ms; waited += pause_ms) {
    file = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (file >= 0 || errno != ENXIO) break;
    ::poll(nullptr, 0, pause_ms);
  }
  if (file < 0 && errno == ENXIO) {
    std::fprintf(stderr, "bristle: %s: a FIFO that nobody reads yet; waiting (Ctrl-C ends it)\n",
                 path.c_str());
    file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  }
  if (file >= 0 && ::fcntl(file, F_SETFL, O_WRONLY) != 0) {
    ::close(file);
    file = -1;
  }
  return file;
}

/// Returns whether two paths name one file. Devices may be named twice, so they count as different.
bool is_same(const std::string& a, const std::string& b) {
  struct stat first, second;
  const bool there = ::stat(a.c_str(), &first) == 0;
  if (there != (::stat(b.c_str(), &second) == 0)) return false;
  if (there) return first.st_dev == second.st_dev && first.st_ino == second.st_ino && !S_ISCHR(first.st_mode);
  std::error_code error;
  return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

}  // namespace

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (path.empty()) return;
  if (path == "-") {
    file_ = stdout;
    return;
  }
  struct stat there;
  if (::stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) {
    const int file = open_special(path);
    if (file < 0 || (file_ = ::fdopen(file, "wb")) == nullptr) fail();
    return;
  }
  open_beside();
}

/// Opens a temporary file beside the output file, with the permissions of the file that it will replace. If
/// the output's path is a link, the file that it points to is replaced.
void OutputFile::open_beside() {
  static std::atomic<unsigned> count{0};
  std::error_code error;
  const fs::path real = fs::canonical(path_, error);
  const std::string target = error ? path_ : real.string();
  struct stat old;
  const bool there = !error && ::stat(target.c_str(), &old) == 0;
  if (there && ::access(target.c_str(), W_OK) != 0) fail();
  remove_on_signals();
  int file = -1;
  const HeldSignals held;
  do {
    beside_ = fmt::format("{}.tmp.{}.{}", target, ::getpid(), count.fetch_add(1));
    file = ::open(beside_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  } while (file < 0 && errno == EEXIST);
  if (file < 0) {
    beside_.clear();
    fail();
  }
  note_unfinished(beside_.c_str());
  if (there) static_cast<void>(::fchmod(file, old.st_mode & 07777));
  path_ = target;
  file_ = ::fdopen(file, "wb");
  if (file_ == nullptr) fail();
}

OutputFile::~OutputFile() {
  if (file_ != nullptr && file_ != stdout) std::fclose(file_);
  if (beside_.empty()) return;
  ::unlink(beside_.c_str());
  forget_unfinished(beside_.c_str());
}

/// Swaps two output files and updates the list of unfinished ones. The list points to the characters of
/// `beside_`, which move with the object if the string is short.
void OutputFile::swap(OutputFile& other) noexcept {
  for (const OutputFile* each : {this, &other})
    if (!each->beside_.empty()) forget_unfinished(each->beside_.c_str());
  std::swap(path_, other.path_);
  std::swap(beside_, other.beside_);
  std::swap(file_, other.file_);
  for (const OutputFile* each : {this, &other})
    if (!each->beside_.empty()) note_unfinished(each->beside_.c_str());
}

void OutputFile::fail() const {
  throw UserError((path_ == "-" ? "standard output" : path_) +
                  ": cannot be written: " + std::strerror(errno));
}

void OutputFile::append(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail();
}

void OutputFile::flush() {
  if (std::fflush(file_) != 0) fail();
}

void OutputFile::finish() {
  flush();
  if (file_ == stdout) return;
  if (!beside_.empty() && ::fsync(::fileno(file_)) != 0) fail();
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail();
  if (beside_.empty()) return;
  if (std::rename(beside_.c_str(), path_.c_str()) != 0) fail();
  forget_unfinished(beside_.c_str());
  beside_.clear();
}

bool is_vector_picture(const std::string& path) { return path.ends_with(".svg"); }

void check_picture_name(const char* option, const std::string& path) {
  if (!path.empty() && path != "-" && !path.ends_with(".png") && !is_vector_picture(path))
    throw UserError(
        fmt::format("{} {}: pictures are PNG or SVG; let its name end in .png or .svg", option, path));
  std::error_code none;
  if (fs::is_character_file(path, none))
    throw UserError(
        fmt::format("{} {}: is a device; gnuplot does not say when it is full. Take a file", option, path));
}

bool check_files(const std::vector<FileOption>& inputs, const std::vector<FileOption>& outputs) {
  std::string on_stdout;
  int count = 0;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto& [option, path] = outputs[i];
    if (path.empty()) continue;
    if (path == "-") {
      on_stdout += (count++ ? ", " : "") + option + " -";
      continue;
    }
    for (const FileOption& input : inputs)
      if (!input.path.empty() && is_same(path, input.path))
        throw UserError(fmt::format("{} {}: is what the command reads ({}); name another file", option, path,
                                    input.option));
    for (std::size_t k = 0; k < i; ++k)
      if (!outputs[k].path.empty() && outputs[k].path != "-" && is_same(path, outputs[k].path))
        throw UserError(
            fmt::format("{} {}: is the file of {} too; name another", option, path, outputs[k].option));
  }
  if (count > 1) throw UserError(on_stdout + ": only one can have stdout");
  return count == 1;
}

}  // namespace cli
