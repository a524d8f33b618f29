#include "servo_watch.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <new>

#include <dlfcn.h>
#include <pthread.h>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BRISTLE_CAN_WATCH 1
#else
#define BRISTLE_CAN_WATCH 0
#endif

namespace {

std::atomic<long> allocations{0}, exceptions{0};
thread_local long locks = 0;

}  // namespace

#if BRISTLE_CAN_WATCH
namespace {

/// Finds the C library's own version of a function that this file replaces.
template <class Function>
Function* real(Function*, const char* name) noexcept {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = memalign(alignment, size);
  return *block ? 0 : ENOMEM;
}
void free(void* block) {
  if (block) allocations.fetch_add(1, std::memory_order_relaxed);
  __libc_free(block);
}

// Defines a counting version of a lock function. Taking a lock that nobody holds makes no system call, so
// only this counter sees it.
#define BRISTLE_COUNTED(name, type)               \
  int name(type* object) noexcept {               \
    static auto* const next = real(&name, #name); \
    ++locks;                                      \
    return next(object);                          \
  }
BRISTLE_COUNTED(pthread_mutex_lock, pthread_mutex_t)
BRISTLE_COUNTED(pthread_mutex_trylock, pthread_mutex_t)
BRISTLE_COUNTED(pthread_rwlock_rdlock, pthread_rwlock_t)
BRISTLE_COUNTED(pthread_rwlock_wrlock, pthread_rwlock_t)
BRISTLE_COUNTED(pthread_cond_signal, pthread_cond_t)
BRISTLE_COUNTED(pthread_cond_broadcast, pthread_cond_t)
#undef BRISTLE_COUNTED

void __cxa_throw(void* object, std::type_info* type, void (*destroy)(void*)) {
  exceptions.fetch_add(1, std::memory_order_relaxed);
  static auto* const next =
      reinterpret_cast<void (*)(void*, void*, void (*)(void*))>(dlsym(RTLD_NEXT, "__cxa_throw"));
  next(object, type, destroy);
  std::abort();  // not reached, because the C++ library's __cxa_throw does not return
}
}
#endif

namespace bristle_test {
namespace {

constexpr int most_calls = 64;

/// Memory shared by parent and child: the child writes the counts, the parent reads them.
struct Shared {
  std::atomic<int> finished, trapped;
  Counts counts;
  std::atomic<long> call_count;
  std::atomic<int> calls[most_calls];
  long value;
};
Shared* shared = nullptr;

void on_system_call(int, siginfo_t* info, void* context) {
  // Sets the system call's return value, which would otherwise be the call's number. A futex reports that it
  // woke nobody: if it reported an error, the C library would end the process.
  const long result = info->si_syscall == SYS_futex ? 0 : -EPERM;
#if defined(__x86_64__)
  static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RAX] = result;
#elif defined(__aarch64__)
  static_cast<ucontext_t*>(context)->uc_mcontext.regs[0] = static_cast<unsigned long long>(result);
#else
  (void)context, (void)result;
#endif
  const long n = shared->call_count.fetch_add(1, std::memory_order_relaxed);
  if (n < most_calls) shared->calls[n].store(info->si_syscall, std::memory_order_relaxed);
}

/// Makes the kernel raise SIGSYS instead of every system call of this thread, except those allowed.
bool trap_system_calls(const std::vector<int>& allowed) {
  struct sigaction action = {};
  action.sa_sigaction = on_system_call;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  if (sigaction(SIGSYS, &action, nullptr) != 0) return false;
  std::vector<sock_filter> filter;
  filter.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)));
  std::vector<int> through{SYS_rt_sigreturn, SYS_exit_group, SYS_exit};
  through.insert(through.end(), allowed.begin(), allowed.end());
  for (const int number : through) {
    filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<__u32>(number), 0, 1));
    filter.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  filter.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP));
  sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

[[noreturn]] void run_child(const std::function<void()>& prepare, const std::function<long()>& steps,
                            const std::vector<int>& allowed) {
  prepare();
  shared->trapped = trap_system_calls(allowed);
  const Counts before = counts_so_far();
  shared->value = steps();
  const Counts after = counts_so_far();
  shared->counts = {after.allocations - before.allocations, after.locks - before.locks,
                    after.exceptions - before.exceptions};
  shared->finished = 1;
  _exit(0);
}

}  // namespace

bool can_watch() noexcept { return BRISTLE_CAN_WATCH; }

Counts counts_so_far() noexcept { return {allocations.load(), locks, exceptions.load()}; }

Sighting watch(const std::function<void()>& prepare, const std::function<long()>& steps,
               const std::vector<int>& allowed) {
  void* const memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return {};
  shared = new (memory) Shared{};
  const pid_t child = fork();
  if (child == 0) run_child(prepare, steps, allowed);
  Sighting seen;
  int status = 0;
  if (child > 0) waitpid(child, &status, 0);
  seen.finished = shared->finished;
  seen.trapped = shared->trapped;
  if (seen.finished && !seen.trapped)
    std::printf("system calls were not watched: this kernel takes no seccomp filter\n");
  seen.counts = shared->counts;
  seen.value = shared->value;
  seen.system_call_count = shared->call_count;
  for (int i = 0; i < std::min<long>(seen.system_call_count, most_calls); ++i)
    seen.system_calls.push_back(shared->calls[i]);
  munmap(memory, sizeof(Shared));
  return seen;
}

std::string system_call_name(int number) {
  static constexpr std::pair<int, const char*> names[] = {{SYS_futex, "futex"},
                                                          {SYS_write, "write"},
                                                          {SYS_read, "read"},
                                                          {SYS_mmap, "mmap"},
                                                          {SYS_munmap, "munmap"},
                                                          {SYS_brk, "brk"},
                                                          {SYS_sched_yield, "sched_yield"},
                                                          {SYS_sched_setaffinity, "sched_setaffinity"},
                                                          {SYS_clock_nanosleep, "clock_nanosleep"},
                                                          {SYS_clock_gettime, "clock_gettime"},
                                                          {SYS_madvise, "madvise"}};
  for (const auto& [known, name] : names)
    if (known == number) return name;
  return std::to_string(number);
}

}  // namespace bristle_test
