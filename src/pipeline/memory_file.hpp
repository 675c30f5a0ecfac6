#pragma once

#include <fmt/core.h>
#include <sys/mman.h>
#include <unistd.h>

#include <string>

namespace unflex::pipeline {

// A file in memory, by a name that others can open.
class MemoryFile {
 public:
  MemoryFile() : fd_(::memfd_create("unflex", MFD_CLOEXEC)) {}
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }

  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  [[nodiscard]] std::string name() const { return fmt::format("/proc/self/fd/{}", fd_); }

 private:
  int fd_;
};

}  // namespace unflex::pipeline
