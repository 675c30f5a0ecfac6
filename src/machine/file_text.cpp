#include "file_text.hpp"

#include <fmt/core.h>

#include <array>
#include <cerrno>
#include <istream>
#include <memory>

#include "unflex/core/errno_text.hpp"
#include "unflex/platform/files.hpp"

namespace unflex::machine {
namespace {

// Printer files have some kilobytes. This limit makes a print that is passed by mistake an error at
// once.
constexpr std::size_t kMaxFileBytes = 1U << 20U;

}  // namespace

Result<std::string> read_printer_file(const std::string& file) {
  const SourcePlace place{file, 0};
  if (platform::is_directory(file)) {
    return fail(ErrorKind::usage, place, "is a directory, not a printer file");
  }
  const std::unique_ptr<std::istream> stream = platform::read_file(file);
  if (!*stream) {
    return fail(ErrorKind::usage, place,
                fmt::format("cannot read the printer file: {}", errno_text(errno)));
  }
  std::string text;
  std::array<char, 4096> block{};
  while (stream->read(block.data(), block.size()) || stream->gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(stream->gcount()));
    if (text.size() > kMaxFileBytes) {
      return fail(ErrorKind::usage, place, "is too large for a printer file");
    }
  }
  if (stream->bad()) {
    return fail(ErrorKind::usage, place, "cannot read the printer file");
  }
  return text;
}

}  // namespace unflex::machine
