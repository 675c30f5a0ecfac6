// A print that is read as its bytes come and written at once, as from pipe to pipe.
#pragma once

#include <atomic>
#include <istream>
#include <memory>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>

#include "cpu_slots.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {

// The text of Job::input_stream. The reader gives its slot back while it waits. The text ends early
// when cancelled or stopped. A stream over it becomes bad if it cannot be read on.
class SourceBuffer final : public std::streambuf {
 public:
  SourceBuffer(const Job& job, const Progress& progress, CpuSlots& slots);

  // Nothing more is wanted: ends a read that is under way in another thread.
  void stop() { stopped_ = true; }

  // The stream that becomes bad.
  void set_stream(std::istream& stream) { stream_ = &stream; }

  // Why the text could not be unpacked, if the stream is bad because of that.
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 protected:
  int_type underflow() override;

 private:
  // Reads the next bytes into block_; false at the end.
  bool read_block();
  bool unpack_block();
  void make_bad();
  [[nodiscard]] bool is_unwanted() const { return stopped_ || progress_->cancelled(); }

  ByteSource* source_;
  std::istream* stream_ = nullptr;
  std::atomic<bool> stopped_ = false;
  const Progress* progress_;
  CpuSlots* slots_;
  std::string block_;
  std::unique_ptr<container::Unpacker> unpacker_;
  std::string text_;  // unpacked text
  std::optional<Error> error_;
  bool is_bad_ = false;
};

// Writes to Job::output_stream.
class SinkBuffer final : public std::streambuf {
 public:
  SinkBuffer(const Job& job, const Progress& progress, CpuSlots& slots);

  // Call it once after all of the text; packed output is incomplete without it. False if not all
  // was written: the work was cancelled, or error() tells why.
  [[nodiscard]] bool finish();

  // The errno of what has gone wrong, or 0.
  [[nodiscard]] int error() const { return error_; }

 protected:
  std::streamsize xsputn(const char* text, std::streamsize count) override;
  int_type overflow(int_type character) override;

 private:
  bool write_out(std::string_view bytes);

  ByteSink* sink_;
  int error_ = 0;
  bool is_whole_ = true;  // all that came has been written
  const Progress* progress_;
  CpuSlots* slots_;
  std::unique_ptr<container::Packer> packer_;
};

}  // namespace unflex::flow
