#include "rewrite_lines.hpp"

#include <filesystem>
#include <fstream>
#include <system_error>

namespace unflex::pipeline {
namespace {

constexpr std::size_t kChunk = 1U << 20U;

}  // namespace

tl::unexpected<Error> output_failed(const std::string& name) {
  return fail(ErrorKind::internal, {name, 0},
              "cannot write the output; make room there, or raise the limit on the size of files "
              "(ulimit -f)");
}

Status rewrite_lines(const std::string& path, const std::string& name, const LineChange& change) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::string chunk(kChunk, '\0');
  std::string unread;   // read, not yet a whole line
  std::string pending;  // to be written once its place has been read
  std::streamoff read_at = 0;
  std::streamoff written_to = 0;
  for (bool more = true; more && file;) {
    file.seekg(read_at);
    file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    const std::streamsize count = file.gcount();
    if (!file.eof() && !file) {
      break;
    }
    file.clear();
    more = static_cast<std::size_t>(count) == chunk.size();
    read_at += count;
    unread.append(chunk, 0, static_cast<std::size_t>(count));
    const std::size_t whole = more ? unread.rfind('\n') + 1 : unread.size();
    change(std::string_view(unread).substr(0, whole), pending);
    unread.erase(0, whole);
    // Do not write over what is still to be read.
    const auto room = static_cast<std::size_t>(read_at - written_to);
    const std::size_t ready = more ? std::min(pending.size(), room) : pending.size();
    file.seekp(written_to);
    file.write(pending.data(), static_cast<std::streamsize>(ready));
    written_to += static_cast<std::streamoff>(ready);
    pending.erase(0, ready);
  }
  file.close();
  std::error_code error;
  if (file) {
    std::filesystem::resize_file(path, static_cast<std::uintmax_t>(written_to), error);
  }
  if (!file || error) {
    return output_failed(name);
  }
  return {};
}

}  // namespace unflex::pipeline
