// Debian's C++ library for WebAssembly cannot throw. Whatever would throw, such as memory that ran
// out, ends the program here.
#include <cstddef>
#include <typeinfo>

extern "C" {

void* __cxa_allocate_exception(std::size_t /*bytes*/) noexcept { __builtin_trap(); }

[[noreturn]] void __cxa_throw(void* /*thrown*/, std::type_info* /*type*/,
                              void (* /*destroy*/)(void*)) {
  __builtin_trap();
}
}
