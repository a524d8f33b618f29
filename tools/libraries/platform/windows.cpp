// The services of Windows. Files are opened by wide names, shared so that they can be renamed and deleted
// while open, as on other systems.
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>
// Must come after windows.h.
#include <cpuid.h>
#include <fcntl.h>
#include <io.h>
#include <shellapi.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <limits>
#include <system_error>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/platform/platform.hpp"

namespace cli::platform {
namespace {

namespace fs = std::filesystem;

std::wstring wide(std::string_view text) {
  const int size = static_cast<int>(text.size());
  std::wstring name(static_cast<std::size_t>(MultiByteToWideChar(CP_UTF8, 0, text.data(), size, nullptr, 0)),
                    L'\0');
  MultiByteToWideChar(CP_UTF8, 0, text.data(), size, name.data(), static_cast<int>(name.size()));
  return name;
}

std::string narrow(std::wstring_view text) {
  const int size = static_cast<int>(text.size());
  const int bytes = WideCharToMultiByte(CP_UTF8, 0, text.data(), size, nullptr, 0, nullptr, nullptr);
  std::string name(static_cast<std::size_t>(bytes), '\0');
  WideCharToMultiByte(CP_UTF8, 0, text.data(), size, name.data(), bytes, nullptr, nullptr);
  return name;
}

/// Translates the last error of Windows to errno.
void set_errno() noexcept {
  switch (GetLastError()) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
      errno = ENOENT;
      break;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS:
      errno = EEXIST;
      break;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
      errno = EACCES;
      break;
    case ERROR_INVALID_NAME:
    case ERROR_BAD_PATHNAME:
      errno = EINVAL;
      break;
    case ERROR_DISK_FULL:
      errno = ENOSPC;
      break;
    default:
      errno = EIO;
  }
}

bool is_folder(const std::wstring& name) noexcept {
  const DWORD attributes = GetFileAttributesW(name.c_str());
  return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
}

/// Opens a file; returns its number in the C runtime, -1 after a failure.
int open_number(const std::string& path, DWORD access, DWORD disposition, int flags) noexcept {
  const std::wstring name = wide(path);
  if (is_folder(name)) {
    errno = EISDIR;
    return -1;
  }
  const HANDLE file =
      CreateFileW(name.c_str(), access, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
                  disposition, FILE_ATTRIBUTE_NORMAL, nullptr);
  if (file == INVALID_HANDLE_VALUE) {
    set_errno();
    return -1;
  }
  const int number = _open_osfhandle(reinterpret_cast<std::intptr_t>(file), flags | _O_BINARY | _O_NOINHERIT);
  if (number < 0) CloseHandle(file);
  return number;
}

std::FILE* stream_of(int file, const char* mode) noexcept {
  std::FILE* const stream = file < 0 ? nullptr : _fdopen(file, mode);
  if (file >= 0 && stream == nullptr) _close(file);
  return stream;
}

HANDLE handle_of(int file) noexcept { return reinterpret_cast<HANDLE>(_get_osfhandle(file)); }
HANDLE handle_of(std::FILE* stream) noexcept { return handle_of(_fileno(stream)); }

/// Returns the one byte, behind every file's end, by which a file is locked: its other bytes stay readable.
OVERLAPPED lock_place() noexcept {
  OVERLAPPED place{};
  place.OffsetHigh = 1u << 30;
  return place;
}

bool has_colours = false;

}  // namespace

fs::path path_of(std::string_view text) { return wide(text); }

std::vector<std::string> arguments(int argc, char** argv) {
  int count = 0;
  wchar_t** const words = CommandLineToArgvW(GetCommandLineW(), &count);
  if (words == nullptr) return {argv, argv + argc};
  std::vector<std::string> texts;
  for (int i = 0; i < count; ++i) texts.push_back(narrow(words[i]));
  LocalFree(words);
  return texts;
}

void hold_standard_streams() noexcept {
  _setmode(_fileno(stdout), _O_BINARY);
  SetConsoleOutputCP(CP_UTF8);
  DWORD mode = 0;
  for (std::FILE* const stream : {stderr, stdout})
    has_colours = GetConsoleMode(handle_of(stream), &mode) != 0 &&
                  SetConsoleMode(handle_of(stream), mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

bool is_terminal(std::FILE* stream) noexcept {
  DWORD mode = 0;
  return GetConsoleMode(handle_of(stream), &mode) != 0;
}

bool shows_colours() noexcept { return has_colours; }

fs::path program_folder() {
  std::wstring name(1 << 15, L'\0');
  name.resize(GetModuleFileNameW(nullptr, name.data(), static_cast<DWORD>(name.size())));
  return fs::path(name).parent_path();
}

unsigned process_number() noexcept { return GetCurrentProcessId(); }

std::tm utc(std::time_t time) noexcept {
  std::tm utc{};
  gmtime_s(&utc, &time);
  return utc;
}

std::string cpu_model() {
  unsigned registers[12] = {};
  for (unsigned i = 0; i < 3; ++i) {
    unsigned* const part = registers + 4 * i;
    if (__get_cpuid(0x80000002u + i, part, part + 1, part + 2, part + 3) == 0) return "unknown";
  }
  char text[sizeof registers + 1] = {};
  std::memcpy(text, registers, sizeof registers);
  const std::string model = text;
  const std::size_t first = std::min(model.find_first_not_of(' '), model.size());
  return model.substr(first, model.find_last_not_of(' ') + 1 - first);
}

std::uint64_t free_memory() {
  MEMORYSTATUSEX memory{};
  memory.dwLength = sizeof memory;
  if (GlobalMemoryStatusEx(&memory) == 0) return std::numeric_limits<std::uint64_t>::max();
  return std::min(memory.ullAvailPhys, memory.ullAvailPageFile);
}

std::string why_no_pictures() { return "pictures are drawn by gnuplot on Linux; --csv works on Windows too"; }
bool has_gnuplot() { return false; }
bool run_gnuplot(const std::string&) { return false; }
std::optional<int> feed_gnuplot(std::string_view) { return {}; }

void on_ending_signals(void (*handler)(int)) {
  for (const int number : {SIGINT, SIGTERM, SIGBREAK}) {
    const auto before = std::signal(number, handler);
    if (before != SIG_DFL) std::signal(number, before);
  }
}

void on_stop_signals(void (*handler)(int)) noexcept {
  for (const int number : {SIGINT, SIGTERM, SIGBREAK}) std::signal(number, handler);
}

// Windows calls handlers on a thread of their own and cannot hold them back.
struct HeldSignals::Mask {};
HeldSignals::HeldSignals() = default;
HeldSignals::~HeldSignals() = default;

std::FILE* open_to_read(const std::string& path) noexcept {
  return stream_of(open_number(path, GENERIC_READ, OPEN_EXISTING, _O_RDONLY), "rb");
}

std::FILE* open_special(const std::string& path) noexcept {
  return stream_of(open_number(path, GENERIC_WRITE, OPEN_EXISTING, _O_WRONLY), "wb");
}

std::FILE* create_file(const std::string& path) noexcept {
  return stream_of(open_number(path, GENERIC_WRITE, CREATE_NEW, _O_WRONLY), "wb");
}

Kind kind_of(const std::string& path) noexcept {
  const std::wstring name = wide(path);
  if (is_folder(name)) return Kind::other;
  const HANDLE file = CreateFileW(name.c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                  nullptr, OPEN_EXISTING, 0, nullptr);
  if (file == INVALID_HANDLE_VALUE) {
    set_errno();
    return Kind::nothing;
  }
  const DWORD type = GetFileType(file);
  CloseHandle(file);
  return type == FILE_TYPE_DISK ? Kind::file : Kind::other;
}

bool is_writable(const std::string& path) noexcept { return _waccess(wide(path).c_str(), 2) == 0; }

bool is_same(const std::string& a, const std::string& b) {
  std::error_code error;
  const Kind first = kind_of(a), second = kind_of(b);
  if ((first == Kind::nothing) != (second == Kind::nothing)) return false;
  if (first == Kind::nothing)
    return fs::weakly_canonical(path_of(a), error) == fs::weakly_canonical(path_of(b), error);
  return first == second && fs::equivalent(path_of(a), path_of(b), error);
}

void copy_permissions(const std::string&, std::FILE*) noexcept {}  // a new file has those of its folder

bool flush_to_disk(std::FILE* file) noexcept { return _commit(_fileno(file)) == 0; }

bool replace_file(const std::string& from, const std::string& to) noexcept {
  if (MoveFileExW(wide(from).c_str(), wide(to).c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) !=
      0)
    return true;
  set_errno();
  return false;
}

void remove_file(const char* path) noexcept { DeleteFileW(wide(path).c_str()); }

bool LockedFile::open(const std::string& path) noexcept {
  file_ = open_number(path, GENERIC_READ | GENERIC_WRITE, OPEN_ALWAYS, _O_RDWR | _O_APPEND);
  return is_open();
}

bool LockedFile::lock() noexcept {
  OVERLAPPED place = lock_place();
  return LockFileEx(handle_of(file_), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &place) !=
             0 ||
         GetLastError() != ERROR_LOCK_VIOLATION;
}

std::int64_t LockedFile::size() noexcept { return _lseeki64(file_, 0, SEEK_END); }

bool LockedFile::cut(std::int64_t size) noexcept {
  if (_lseeki64(file_, size, SEEK_SET) == size && SetEndOfFile(handle_of(file_)) != 0) return true;
  set_errno();
  return false;
}

bool LockedFile::append(std::string_view text) noexcept {
  while (!text.empty()) {
    const auto piece = static_cast<unsigned>(std::min<std::size_t>(text.size(), 1u << 30));
    const int wrote = _write(file_, text.data(), piece);
    if (wrote < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(wrote));
  }
  return true;
}

void LockedFile::flush() noexcept { _commit(file_); }

void LockedFile::close() noexcept {
  if (file_ >= 0) _close(file_);
  file_ = -1;
}

std::int64_t now_ns() noexcept { return std::llround(1e9 * bristle::DeadlineMonitor::wall_now()); }

/// Sleeps by a timer of high resolution (half a millisecond or better), which Windows has since 10, version
/// 1803; older ones wake a thread within 16 ms.
void sleep_until(std::int64_t ns, bool (*stop)() noexcept) noexcept {
  constexpr DWORD high_resolution = 2;           // CREATE_WAITABLE_TIMER_HIGH_RESOLUTION
  constexpr std::int64_t most_ns = 100'000'000;  // ns, longest time for which a signal goes unseen
  struct Timer {
    HANDLE handle = CreateWaitableTimerExW(nullptr, nullptr, high_resolution, TIMER_ALL_ACCESS);
    Timer() noexcept {
      if (handle == nullptr) handle = CreateWaitableTimerExW(nullptr, nullptr, 0, TIMER_ALL_ACCESS);
    }
    ~Timer() { CloseHandle(handle); }
  };
  thread_local const Timer timer;
  for (std::int64_t left; (left = ns - now_ns()) > 0 && !stop();) {
    LARGE_INTEGER due;
    due.QuadPart = -std::max<std::int64_t>(1, std::min(left, most_ns) / 100);  // in 100 ns, from now
    if (SetWaitableTimer(timer.handle, &due, 0, nullptr, nullptr, FALSE) == 0) return;
    WaitForSingleObject(timer.handle, INFINITE);
  }
}

// Windows tells a program neither what a hypervisor has stolen nor how long a thread waited for a core.
double stolen_now() { return 0.0; }
QueueClock::QueueClock() noexcept : file_(-1) {}
QueueClock::~QueueClock() = default;
double QueueClock::now() const noexcept { return 0.0 * file_; }

int use_exact_timers() noexcept { return 0; }  // sleep_until() has its own
void use_timers(int) noexcept {}

std::string bind_thread(int core, std::vector<int>& before) {
  constexpr int most = std::numeric_limits<DWORD_PTR>::digits;
  const DWORD_PTR old = core < most ? SetThreadAffinityMask(GetCurrentThread(), DWORD_PTR{1} << core) : 0;
  if (old == 0) return "this process may not use it; any core instead";
  for (int i = 0; i < most; ++i)
    if ((old >> i & 1) != 0) before.push_back(i);
  return {};
}

void use_cores(const std::vector<int>& cores) noexcept {
  DWORD_PTR mask = 0;
  for (const int core : cores) mask |= DWORD_PTR{1} << core;
  SetThreadAffinityMask(GetCurrentThread(), mask);
}

/// Asks the scheduler for multimedia (MMCSS) instead, which raises the priority of the thread until it ends
/// and still leaves other programs a fifth of the time.
std::string take_fifo(int) {
  DWORD task = 0;
  const HMODULE library = LoadLibraryW(L"avrt.dll");
  using Join = HANDLE(WINAPI*)(const wchar_t*, DWORD*);
  const FARPROC found =
      library != nullptr ? GetProcAddress(library, "AvSetMmThreadCharacteristicsW") : nullptr;
  Join join = nullptr;
  std::memcpy(&join, &found, sizeof join);
  const bool joined = join != nullptr && join(L"Pro Audio", &task) != nullptr;
  return joined ? "not on Windows; the priority of its multimedia class 'Pro Audio' instead"
                : "not on Windows, and its multimedia class was refused; usual scheduling instead";
}

void use_usual_scheduling() noexcept {}

std::string lock_memory() { return "not on Windows; pages may be taken away"; }
void unlock_memory() noexcept {}

}  // namespace cli::platform
