// Streams over file descriptors: a pipe is read as its text comes and written to at once.
#pragma once

#include <istream>
#include <ostream>
#include <streambuf>
#include <string>

#include "cpu_slots.hpp"
#include "unflex/core/progress.hpp"

namespace unflex::pipeline {

// The reader gives its slot back while it waits. Ends early when cancelled.
class FdSource final : public std::streambuf {
 public:
  // head: what of the text has been read already.
  FdSource(std::string head, int fd, const Progress& progress, CpuSlots& slots)
      : fd_(fd), progress_(&progress), slots_(&slots), block_(std::move(head)) {
    setg(block_.data(), block_.data(), block_.data() + block_.size());
  }

 protected:
  int_type underflow() override;

 private:
  int fd_;
  const Progress* progress_;
  CpuSlots* slots_;
  std::string block_;
};

class FdSink final : public std::streambuf {
 public:
  FdSink(int fd, const Progress& progress, CpuSlots& slots)
      : fd_(fd), progress_(&progress), slots_(&slots) {}

  // The errno of what has gone wrong, or 0.
  [[nodiscard]] int error() const { return error_; }

 protected:
  std::streamsize xsputn(const char* text, std::streamsize count) override;
  int_type overflow(int_type character) override;

 private:
  int fd_;
  int error_ = 0;
  const Progress* progress_;
  CpuSlots* slots_;
};

}  // namespace unflex::pipeline
