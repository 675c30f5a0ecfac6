// Debian's C++ library for WebAssembly can throw nothing, and nothing can be caught. Its host can:
// the functions of the module "unflex" below are the host's. What is thrown outside of catching()
// ends the program.
#include <cstddef>
#include <cstdlib>
#include <typeinfo>

#include "unflex/platform/catching.hpp"

namespace {

const std::exception* thrown_last = nullptr;

void call(const void* work) { (*static_cast<const std::function<void()>*>(work))(); }

}  // namespace

extern "C" {

// Calls the function and returns 0, or 1 if throw_here() was called meanwhile: the host takes back
// what is left of the call. The function is given as it stands in the table of functions, since one
// that is exported would set up the whole program anew.
[[clang::import_module("unflex"), clang::import_name("call_catching")]] int call_catching(
    void (*function)(const void*), const void* argument);
[[noreturn, clang::import_module("unflex"), clang::import_name("throw_here")]] void throw_here();

void* __cxa_allocate_exception(std::size_t bytes) noexcept {
  // Never given back, since there is little of it. Where memory has run out, this is all there is.
  alignas(16) static char last_room[1024];
  void* const room = std::malloc(bytes);
  return room != nullptr ? room : last_room;
}

// All that is thrown here has std::exception as its first base.
[[noreturn]] void __cxa_throw(void* thrown, std::type_info* /*type*/, void (* /*destroy*/)(void*)) {
  thrown_last = static_cast<const std::exception*>(thrown);
  throw_here();
}
}

namespace unflex::platform {

void catching(const std::function<void()>& work,
              const std::function<void(const std::exception&)>& caught) {
  if (call_catching(call, &work) != 0) {
    caught(*thrown_last);
  }
}

}  // namespace unflex::platform
