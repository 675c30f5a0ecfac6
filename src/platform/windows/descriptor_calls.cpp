#include "../descriptor_calls.hpp"

#include <io.h>
#include <windows.h>

#include <algorithm>

namespace unflex::platform {
namespace {

unsigned at_once(std::size_t bytes) {
  constexpr std::size_t kMost = 1U << 20U;
  return static_cast<unsigned>(std::min(bytes, kMost));
}

HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)); }

}  // namespace

// A pipe cannot be waited for, so it is asked again and again. All else reads at once.
bool wait_to_read(int descriptor, std::chrono::milliseconds most) {
  constexpr DWORD kPause_ms = 5;
  const HANDLE handle = handle_of(descriptor);
  if (GetFileType(handle) != FILE_TYPE_PIPE) {
    return true;
  }
  for (auto left = most.count();;) {
    DWORD bytes = 0;
    if (PeekNamedPipe(handle, nullptr, 0, nullptr, &bytes, nullptr) == 0 || bytes > 0) {
      return true;  // an error is the end of the pipe, or shows when it is read
    }
    if (left <= 0) {
      return false;
    }
    Sleep(kPause_ms);
    left -= kPause_ms;
  }
}

// A write waits itself.
bool wait_to_write(int /*descriptor*/, std::chrono::milliseconds /*most*/) { return true; }

std::ptrdiff_t read_bytes(int descriptor, char* to, std::size_t room) {
  return _read(descriptor, to, at_once(room));
}

std::ptrdiff_t write_bytes(int descriptor, std::string_view bytes) {
  return _write(descriptor, bytes.data(), at_once(bytes.size()));
}

}  // namespace unflex::platform
