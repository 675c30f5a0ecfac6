#include "unflex/platform/descriptors.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>

namespace unflex::platform {
namespace {

bool wait_for(int descriptor, short events, std::chrono::milliseconds most) {
  pollfd what{descriptor, events, 0};
  const int count = ::poll(&what, 1, static_cast<int>(most.count()));
  return count > 0 || (count < 0 && errno != EINTR);
}

tl::expected<std::size_t, int> outcome(ssize_t count) {
  if (count < 0) {
    return tl::unexpected(errno);
  }
  return static_cast<std::size_t>(count);
}

class DescriptorSource final : public ByteSource {
 public:
  explicit DescriptorSource(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_for(descriptor_, POLLIN, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> read(char* to, std::size_t room) override {
    return outcome(::read(descriptor_, to, room));
  }

 private:
  int descriptor_;
};

class DescriptorSink final : public ByteSink {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_for(descriptor_, POLLOUT, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> write(std::string_view bytes) override {
    return outcome(::write(descriptor_, bytes.data(), bytes.size()));
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
