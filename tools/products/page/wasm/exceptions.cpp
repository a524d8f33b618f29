// Hands exceptions to JavaScript, since Debian's libc++ for WebAssembly has none: `refuse` throws there, so
// that no destructor on the way runs. The caller in JavaScript restores the stack pointer.
#include <cstdlib>
#include <exception>
#include <typeinfo>

extern "C" {

[[noreturn]] __attribute__((import_module("page"), import_name("refuse"))) void refuse(const char* why);

void* __cxa_allocate_exception(std::size_t size) noexcept { return std::malloc(size); }
void __cxa_free_exception(void* thrown) noexcept { std::free(thrown); }
/// Passes what() to JavaScript. The cast holds: all exceptions here derive from std::exception alone.
[[noreturn]] void __cxa_throw(void* thrown, std::type_info*, void (*)(void*)) {
  refuse(static_cast<std::exception*>(thrown)->what());
}
}
