#include "unflex/platform/descriptors.hpp"

#include <fcntl.h>
#include <io.h>
#include <windows.h>

#include <algorithm>

#include "../close_descriptor.hpp"
#include "open_shared.hpp"
#include "utf16.hpp"

namespace unflex::platform {
namespace {

unsigned at_once(std::size_t bytes) {
  constexpr std::size_t kMost = 1U << 20U;
  return static_cast<unsigned>(std::min(bytes, kMost));
}

HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)); }

}  // namespace

FileDescriptor open_shared(const std::string& name, unsigned long access, unsigned long creation,
                           unsigned long flags) {
  const HANDLE handle = CreateFileW(path_of(name).c_str(), access,
                                    FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
                                    creation, FILE_ATTRIBUTE_NORMAL | flags, nullptr);
  if (handle == INVALID_HANDLE_VALUE) {
    last_error();
    return {};
  }
  return FileDescriptor(_open_osfhandle(reinterpret_cast<std::intptr_t>(handle), _O_BINARY));
}

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

FileDescriptor open_to_read(const std::string& name) {
  // A folder too, which then turns out to be none to read.
  return open_shared(name, GENERIC_READ, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS);
}

FileDescriptor open_to_write(const std::string& name) {
  return open_shared(name, GENERIC_WRITE, OPEN_EXISTING);
}

FileDescriptor open_to_append(const std::string& name) {
  return open_shared(name, FILE_APPEND_DATA, OPEN_ALWAYS);
}

void close_descriptor(int descriptor) { _close(descriptor); }

std::ptrdiff_t read_bytes_at(int descriptor, char* to, std::size_t room, std::uint64_t at) {
  OVERLAPPED place{};
  place.Offset = static_cast<DWORD>(at);
  place.OffsetHigh = static_cast<DWORD>(at >> 32U);
  DWORD count = 0;
  if (ReadFile(handle_of(descriptor), to, at_once(room), &count, &place) == 0) {
    if (GetLastError() == ERROR_HANDLE_EOF) {
      return 0;
    }
    last_error();
    return -1;
  }
  return static_cast<std::ptrdiff_t>(count);
}

}  // namespace unflex::platform
