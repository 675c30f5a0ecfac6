#include "unflex/platform/descriptors.hpp"

#include <io.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>

namespace unflex::platform {
namespace {

HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)); }

// A pipe cannot be waited for, so it is asked again and again. All else reads at once.
bool wait_for_bytes(int descriptor, std::chrono::milliseconds most) {
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

constexpr std::size_t kMostAtOnce = 1U << 20U;

tl::expected<std::size_t, int> outcome(int count) {
  if (count < 0) {
    return tl::unexpected(errno);
  }
  return static_cast<std::size_t>(count);
}

class DescriptorSource final : public ByteSource {
 public:
  explicit DescriptorSource(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_for_bytes(descriptor_, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> read(char* to, std::size_t room) override {
    return outcome(_read(descriptor_, to, static_cast<unsigned>(std::min(room, kMostAtOnce))));
  }

 private:
  int descriptor_;
};

// A write waits itself.
class DescriptorSink final : public ByteSink {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds /*most*/) override { return true; }
  [[nodiscard]] tl::expected<std::size_t, int> write(std::string_view bytes) override {
    return outcome(_write(descriptor_, bytes.data(),
                          static_cast<unsigned>(std::min(bytes.size(), kMostAtOnce))));
  }

 private:
  int descriptor_;
};

}  // namespace

std::shared_ptr<ByteSource> descriptor_source(int descriptor) {
  return std::make_shared<DescriptorSource>(descriptor);
}

std::shared_ptr<ByteSink> descriptor_sink(int descriptor) {
  return std::make_shared<DescriptorSink>(descriptor);
}

}  // namespace unflex::platform
