#include "stream_buffers.hpp"

#include <cerrno>
#include <chrono>
#include <functional>
#include <string_view>
#include <utility>

namespace unflex::flow {
namespace {

constexpr std::size_t kBlockBytes = 256 * 1024;
// The longest single wait. After it the waiting thread sees whether the wait is still wanted.
constexpr std::chrono::milliseconds kPatience{50};

// Waits until the stream is ready; false once it is unwanted.
template <class Stream>
bool ready(Stream& stream, CpuSlots& slots, const std::function<bool()>& is_unwanted) {
  if (stream.wait(std::chrono::milliseconds(0))) {
    return true;
  }
  const CpuSlot::Without without(slots);
  while (!is_unwanted()) {
    if (stream.wait(kPatience)) {
      return true;
    }
  }
  return false;
}

bool is_worth_another_try(int error) { return error == EINTR || error == EAGAIN; }

}  // namespace

SourceBuffer::SourceBuffer(const Job& job, const Progress& progress, CpuSlots& slots)
    : source_(job.input_stream.get()),
      progress_(&progress),
      slots_(&slots),
      block_(job.input_head) {
  if (source_ != nullptr) {
    unpacker_ = container::make_unpacker(job.input_stream_kind, job.input_name);
  }
  if (unpacker_) {
    unpacker_->push(block_);
  } else {
    setg(block_.data(), block_.data(), block_.data() + block_.size());
  }
}

bool SourceBuffer::read_block() {
  block_.resize(kBlockBytes);
  while (!stopped_ && ready(*source_, *slots_, [this] { return is_unwanted(); })) {
    const tl::expected<std::size_t, int> count = source_->read(block_.data(), block_.size());
    if (count) {
      block_.resize(*count);
      return *count > 0;
    }
    if (!is_worth_another_try(count.error())) {
      make_bad();
      return false;
    }
  }
  return false;
}

void SourceBuffer::make_bad() {
  is_bad_ = true;
  if (stream_ != nullptr) {
    stream_->setstate(std::ios::badbit);
  }
}

bool SourceBuffer::unpack_block() {
  for (bool more = true;;) {
    Result<std::string> text = unpacker_->pull();
    if (!text) {
      error_ = text.error();
      make_bad();
      return false;
    }
    if (!text->empty() || !more) {
      text_ = std::move(*text);
      return !text_.empty();
    }
    more = read_block();
    if (more) {
      unpacker_->push(block_);
    } else if (is_unwanted() || is_bad_) {
      return false;
    } else {
      unpacker_->finish();
    }
  }
}

SourceBuffer::int_type SourceBuffer::underflow() {
  if (is_bad_ || !(unpacker_ ? unpack_block() : read_block())) {
    return traits_type::eof();
  }
  std::string& text = unpacker_ ? text_ : block_;
  setg(text.data(), text.data(), text.data() + text.size());
  return traits_type::to_int_type(*gptr());
}

SinkBuffer::SinkBuffer(const Job& job, const Progress& progress, CpuSlots& slots)
    : sink_(job.output_stream.get()), progress_(&progress), slots_(&slots) {
  if (sink_ != nullptr && job.output_stream_kind == container::Kind::gzip) {
    packer_ = container::make_gzip_packer();
  }
}

bool SinkBuffer::write_out(std::string_view bytes) {
  const auto cancelled = [this] { return progress_->cancelled(); };
  while (!bytes.empty() && ready(*sink_, *slots_, cancelled)) {
    const tl::expected<std::size_t, int> some = sink_->write(bytes);
    if (some) {
      bytes.remove_prefix(*some);
    } else if (!is_worth_another_try(some.error())) {
      error_ = some.error();
      break;
    }
  }
  is_whole_ = is_whole_ && bytes.empty();
  return bytes.empty();
}

// Gzip cannot fail to pack.
std::streamsize SinkBuffer::xsputn(const char* text, std::streamsize count) {
  const std::string_view piece(text, static_cast<std::size_t>(count));
  const bool written = packer_ ? write_out(*packer_->push(piece)) : write_out(piece);
  return written ? count : 0;
}

bool SinkBuffer::finish() {
  if (packer_ && is_whole_) {
    write_out(*packer_->finish());
  }
  return is_whole_;
}

SinkBuffer::int_type SinkBuffer::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) {
    return traits_type::not_eof(character);
  }
  const char text = traits_type::to_char_type(character);
  return xsputn(&text, 1) == 1 ? character : traits_type::eof();
}

}  // namespace unflex::flow
