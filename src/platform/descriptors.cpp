#include "unflex/platform/descriptors.hpp"

#include <cerrno>

#include "descriptor_calls.hpp"

namespace unflex::platform {
namespace {

tl::expected<std::size_t, int> outcome(std::ptrdiff_t count) {
  if (count < 0) {
    return tl::unexpected(errno);
  }
  return static_cast<std::size_t>(count);
}

class DescriptorSource final : public ByteSource {
 public:
  explicit DescriptorSource(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_to_read(descriptor_, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> read(char* to, std::size_t room) override {
    return outcome(read_bytes(descriptor_, to, room));
  }

 private:
  int descriptor_;
};

class DescriptorSink final : public ByteSink {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_to_write(descriptor_, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> write(std::string_view bytes) override {
    return outcome(write_bytes(descriptor_, bytes));
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
