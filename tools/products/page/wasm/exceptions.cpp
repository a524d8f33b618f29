// Passes exceptions on to JavaScript, because Debian's libc++ for WebAssembly cannot throw them. `refuse`
// throws in JavaScript, so no destructor on the way runs, and the caller there restores the stack pointer.
#include <cstdlib>
#include <exception>
#include <typeinfo>

extern "C" {

[[noreturn]] __attribute__((import_module("page"), import_name("refuse"))) void refuse(const char* why);

void* __cxa_allocate_exception(std::size_t size) noexcept { return std::malloc(size); }
void __cxa_free_exception(void* thrown) noexcept { std::free(thrown); }
/// Passes the text of an exception to JavaScript. The cast is valid, because all exceptions here derive from
/// std::exception alone.
[[noreturn]] void __cxa_throw(void* thrown, std::type_info*, void (*)(void*)) {
  refuse(static_cast<std::exception*>(thrown)->what());
}
}
