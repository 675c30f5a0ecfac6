#include "unflex/platform/descriptors.hpp"

#include <unistd.h>

#include <cerrno>

namespace unflex::platform {
namespace {

tl::expected<std::size_t, int> outcome(ssize_t count) {
  if (count < 0) {
    return tl::unexpected(errno);
  }
  return static_cast<std::size_t>(count);
}

// A read or write waits itself, since there is nothing else to do meanwhile.
class DescriptorSource final : public ByteSource {
 public:
  explicit DescriptorSource(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds /*most*/) override { return true; }
  [[nodiscard]] tl::expected<std::size_t, int> read(char* to, std::size_t room) override {
    return outcome(::read(descriptor_, to, room));
  }

 private:
  int descriptor_;
};

class DescriptorSink final : public ByteSink {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds /*most*/) override { return true; }
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
