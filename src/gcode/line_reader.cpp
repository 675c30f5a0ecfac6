#include <cstring>
#include <utility>

#include "unflex/gcode/line.hpp"

namespace unflex::gcode {
namespace {

constexpr std::size_t kBlockBytes = 256 * 1024;
constexpr std::size_t kLongestLineBytes = 1024 * 1024;

// Recognises UTF-16 by its byte order mark.
bool is_utf16(std::string_view text) {
  return text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff");
}

}  // namespace

std::string_view Line::content() const {
  std::string_view view = text;
  if (view.ends_with('\n')) {
    view.remove_suffix(1);
    if (view.ends_with('\r')) {
      view.remove_suffix(1);
    }
  }
  return view;
}

bool Line::has_bare_return() const {
  if (!may_hold_return) {
    return false;
  }
  const std::string_view view = content();
  const std::size_t at = view.find('\r');
  return at != std::string_view::npos &&
         view.find_first_not_of("\r \t", at) != std::string_view::npos;
}

LineReader::LineReader(std::istream& stream, std::string name)
    : stream_(&stream), name_(std::move(name)), block_(kBlockBytes) {}

// Takes what the stream has now and does not wait for a full block: a stream that is still being
// written may bring no more for a long time.
void LineReader::fill_block() {
  cursor_ = 0;
  filled_ = 0;
  if (stream_->peek() != std::istream::traits_type::eof()) {
    filled_ = static_cast<std::size_t>(
        stream_->readsome(block_.data(), static_cast<std::streamsize>(block_.size())));
  }
  // One search per block is faster than one per line.
  const std::string_view block(block_.data(), filled_);
  block_has_return_ = block.find('\r') != std::string_view::npos;
  block_has_nul_ = block.find('\0') != std::string_view::npos;
}

Result<bool> LineReader::next(Line& line) {
  line.text.clear();
  line.number = line_number_ + 1;
  line.may_hold_return = false;
  while (!line.text.ends_with('\n')) {
    if (cursor_ == filled_) {
      fill_block();
      if (stream_->bad()) {
        return fail(ErrorKind::internal, {name_, line.number},
                    "cannot read on: input/output error");
      }
      if (filled_ == 0) {
        break;
      }
    }
    const char* const begin = block_.data() + cursor_;
    if (bytes_read_ == 0 && line.text.empty() && is_utf16({begin, filled_ - cursor_})) {
      return fail(ErrorKind::input, {name_, line.number},
                  "the text is UTF-16; save it as UTF-8 without a byte order mark");
    }
    const std::size_t left = filled_ - cursor_;
    const void* const newline = std::memchr(begin, '\n', left);
    const std::size_t taken =
        newline == nullptr
            ? left
            : static_cast<std::size_t>(static_cast<const char*>(newline) - begin) + 1;
    if (block_has_nul_ && std::memchr(begin, '\0', taken) != nullptr) {
      return fail(ErrorKind::input, {name_, line.number},
                  "not a text file (NUL byte); pass G-code as plain text");
    }
    if (line.text.size() + taken > kLongestLineBytes) {
      return fail(ErrorKind::input, {name_, line.number},
                  "line longer than 1 MiB; pass G-code as plain text");
    }
    line.may_hold_return = line.may_hold_return || block_has_return_;
    line.text.append(begin, taken);
    cursor_ += taken;
  }
  if (line.text.empty()) {
    return false;
  }
  ++line_number_;
  bytes_read_ += line.text.size();
  return true;
}

}  // namespace unflex::gcode
