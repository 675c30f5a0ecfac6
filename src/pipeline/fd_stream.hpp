// Streams over file descriptors: a pipe is read as its text comes and written to at once.
#pragma once

#include <istream>
#include <memory>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>

#include "cpu_slots.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/pipeline/pipeline.hpp"

namespace unflex::pipeline {

// The reader gives its slot back while it waits. Ends early when cancelled.
class FdSource final : public std::streambuf {
 public:
  FdSource(const Job& job, const Progress& progress, CpuSlots& slots);

  // What was wrong with packed text, where the stream is bad for that.
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 protected:
  int_type underflow() override;

 private:
  // The next bytes into block_; false at the end.
  bool read_block();
  bool unpack_block();

  int fd_;
  const Progress* progress_;
  CpuSlots* slots_;
  std::string block_;
  std::unique_ptr<container::Unpacker> unpacker_;
  std::string text_;  // unpacked
  std::optional<Error> error_;
};

class FdSink final : public std::streambuf {
 public:
  FdSink(const Job& job, const Progress& progress, CpuSlots& slots);

  // To be called once after all of the text; what is packed is incomplete without.
  void finish();

  // The errno of what has gone wrong, or 0.
  [[nodiscard]] int error() const { return error_; }

 protected:
  std::streamsize xsputn(const char* text, std::streamsize count) override;
  int_type overflow(int_type character) override;

 private:
  bool write_out(std::string_view bytes);

  int fd_;
  int error_ = 0;
  const Progress* progress_;
  CpuSlots* slots_;
  std::unique_ptr<container::Packer> packer_;
};

}  // namespace unflex::pipeline
