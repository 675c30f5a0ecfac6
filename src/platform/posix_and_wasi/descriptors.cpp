#include "unflex/platform/descriptors.hpp"

#include <fcntl.h>
#include <unistd.h>

#include "../close_descriptor.hpp"

namespace unflex::platform {

FileDescriptor open_to_read(const std::string& name) {
  return FileDescriptor(::open(name.c_str(), O_RDONLY | O_CLOEXEC));
}

FileDescriptor open_to_write(const std::string& name) {
  return FileDescriptor(::open(name.c_str(), O_WRONLY | O_CLOEXEC));
}

FileDescriptor open_to_append(const std::string& name) {
  constexpr int kMode = 0666;
  return FileDescriptor(::open(name.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, kMode));
}

void close_descriptor(int descriptor) { ::close(descriptor); }

std::ptrdiff_t read_bytes(int descriptor, char* to, std::size_t room) {
  return ::read(descriptor, to, room);
}

std::ptrdiff_t write_bytes(int descriptor, std::string_view bytes) {
  return ::write(descriptor, bytes.data(), bytes.size());
}

std::ptrdiff_t read_bytes_at(int descriptor, char* to, std::size_t room, std::uint64_t at) {
  return ::pread(descriptor, to, room, static_cast<off_t>(at));
}

}  // namespace unflex::platform
