#include "tools/libraries/files/output_file.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

namespace fs = std::filesystem;

/// Names of the output files that are not complete yet. A signal handler deletes them; as it may neither lock
/// nor allocate, they are C strings in an array of fixed size, each owned by an OutputFile.
std::array<std::atomic<const char*>, 64> unfinished;

extern "C" void remove_unfinished(int signal_number) {
  for (const auto& name : unfinished)
    if (const char* path = name.load()) platform::remove_file(path);
  std::signal(signal_number, SIG_DFL);
  std::raise(signal_number);
}

void note_unfinished(const char* name) {
  for (auto& slot : unfinished) {
    const char* none = nullptr;
    if (slot.compare_exchange_strong(none, name)) return;
  }
}

void forget_unfinished(const char* name) {
  for (auto& slot : unfinished) {
    const char* held = name;
    if (slot.compare_exchange_strong(held, nullptr)) return;
  }
}

}  // namespace

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (path.empty()) return;
  if (path == "-") {
    file_ = stdout;
    return;
  }
  if (platform::kind_of(path) == platform::Kind::other) {
    file_ = platform::open_special(path);
    if (file_ == nullptr) fail();
    return;
  }
  open_beside();
}

/// Opens a temporary file beside the output file, with the permissions of the file that it will replace. If
/// the output's path is a link, the file that it points to is replaced.
void OutputFile::open_beside() {
  static std::atomic<unsigned> count{0};
  std::error_code error;
  const fs::path real = fs::canonical(fs::path(path_), error);
  const std::string target = error ? path_ : real.string();
  const bool there = !error && platform::kind_of(target) != platform::Kind::nothing;
  if (there && !platform::is_writable(target)) fail();
  platform::on_ending_signals(&remove_unfinished);
  // Holds signals back. A signal between making the file and noting its name would leave the file behind.
  const platform::HeldSignals held;
  do {
    beside_ = fmt::format("{}.tmp.{}.{}", target, platform::process_number(), count.fetch_add(1));
    file_ = platform::create_file(beside_);
  } while (file_ == nullptr && errno == EEXIST);
  if (file_ == nullptr) {
    beside_.clear();
    fail();
  }
  note_unfinished(beside_.c_str());
  if (there) fs::permissions(beside_, fs::status(target, error).permissions(), error);
  path_ = target;
}

OutputFile::~OutputFile() {
  if (file_ != nullptr && file_ != stdout) std::fclose(file_);
  if (beside_.empty()) return;
  platform::remove_file(beside_.c_str());
  forget_unfinished(beside_.c_str());
}

/// Swaps two output files. The list of unfinished files, which are removed when the program is interrupted,
/// points to the characters of `beside_`, the path of the temporary file. They may move in a swap, so both
/// files leave the list and enter it again.
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
  if (!beside_.empty() && !platform::flush_to_disk(file_)) fail();
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
  if (fs::is_character_file(fs::path(path), none))
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
      if (!input.path.empty() && platform::is_same(path, input.path))
        throw UserError(fmt::format("{} {}: is what the command reads ({}); name another file", option, path,
                                    input.option));
    for (std::size_t k = 0; k < i; ++k)
      if (!outputs[k].path.empty() && outputs[k].path != "-" && platform::is_same(path, outputs[k].path))
        throw UserError(
            fmt::format("{} {}: is the file of {} too; name another", option, path, outputs[k].option));
  }
  if (count > 1) throw UserError(on_stdout + ": only one can have stdout");
  return count == 1;
}

}  // namespace cli
