#include "unflex/machine/print_text.hpp"

#include <algorithm>
#include <istream>
#include <memory>
#include <utility>

#include "unflex/gcode/command.hpp"

namespace unflex::machine {
namespace {

// OrcaSlicer's settings with long start and end codes stay far below this.
constexpr std::size_t kTailBytes = std::size_t{1} << 19U;
constexpr std::size_t kBlockBytes = std::size_t{1} << 16U;

bool is_move(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t");
  if (first == std::string_view::npos || line[first] == ';') {
    return false;
  }
  const gcode::Command command = gcode::parse(line.substr(0, line.find('\r')));
  return command.kind == gcode::CommandKind::traditional && command.letter == 'G' &&
         command.number >= 0 && command.number <= 3 && !command.words.empty();
}

}  // namespace

std::size_t head_end(std::string_view text) {
  const bool is_full = text.size() >= kMaxHeadBytes;
  // No more than these bytes are looked at, however much of the text has come.
  text = text.substr(0, kMaxHeadBytes);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) {
      break;
    }
    if (is_move(text.substr(at, end - at))) {
      return end + 1;
    }
    at = end + 1;
  }
  return is_full ? text.rfind('\n') + 1 : std::string_view::npos;
}

Result<PrintText> read_print_text(const TextStore& text, const std::string& name) {
  const std::unique_ptr<std::istream> stream = text.read();
  PrintText print{.name = name, .head = {}, .tail = {}, .tail_line = 1, .is_stream = false};
  std::string block(kBlockBytes, '\0');
  std::size_t lines = 0;
  bool in_head = true;
  // One pass through all of the file, since a line's number needs the count of the lines before it.
  while (stream->read(block.data(), static_cast<std::streamsize>(block.size())) ||
         stream->gcount() > 0) {
    const std::string_view read(block.data(), static_cast<std::size_t>(stream->gcount()));
    lines += static_cast<std::size_t>(std::ranges::count(read, '\n'));
    if (in_head) {
      print.head += read;
      const std::size_t end = head_end(print.head);
      in_head = end == std::string_view::npos;
      print.head.resize(std::min(end, print.head.size()));
    }
    print.tail += read;
    if (print.tail.size() > 2 * kTailBytes) {
      print.tail.erase(0, print.tail.size() - kTailBytes);
    }
  }
  if (stream->bad() || !stream->eof()) {
    return fail(ErrorKind::input, {name, 0}, "cannot read the file");
  }
  const std::size_t in_tail = static_cast<std::size_t>(std::ranges::count(print.tail, '\n'));
  if (in_tail < lines) {
    print.tail.erase(0, print.tail.find('\n') + 1);
    print.tail_line = lines - in_tail + 2;
  }
  return print;
}

}  // namespace unflex::machine
