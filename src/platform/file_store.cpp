#include <algorithm>
#include <istream>
#include <ostream>
#include <utility>

#include "unflex/platform/files.hpp"

namespace unflex::platform {
namespace {

constexpr std::size_t kChunk = 1U << 20U;

class FileStore final : public TextStore {
 public:
  explicit FileStore(std::string name) : name_(std::move(name)) {}

  [[nodiscard]] std::unique_ptr<std::istream> read() const override { return read_file(name_); }
  [[nodiscard]] std::unique_ptr<std::ostream> write() override { return write_file(name_); }
  [[nodiscard]] std::optional<std::uint64_t> bytes() const override { return file_bytes(name_); }

  // Text by which the file grows is held in memory.
  [[nodiscard]] bool rewrite(const LineChange& change) override {
    std::unique_ptr<std::iostream> file = change_file(name_);
    std::string chunk(kChunk, '\0');
    std::string unread;   // read, not yet a whole line
    std::string pending;  // to be written once its place has been read
    std::streamoff read_at = 0;
    std::streamoff written_to = 0;
    for (bool more = true; more && *file;) {
      file->seekg(read_at);
      file->read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
      const std::streamsize count = file->gcount();
      if (!file->eof() && !*file) {
        break;
      }
      file->clear();
      more = static_cast<std::size_t>(count) == chunk.size();
      read_at += count;
      unread.append(chunk, 0, static_cast<std::size_t>(count));
      const std::size_t whole = more ? unread.rfind('\n') + 1 : unread.size();
      change(std::string_view(unread).substr(0, whole), pending);
      unread.erase(0, whole);
      // Do not write over what is still to be read.
      const auto room = static_cast<std::size_t>(read_at - written_to);
      const std::size_t ready = more ? std::min(pending.size(), room) : pending.size();
      file->seekp(written_to);
      file->write(pending.data(), static_cast<std::streamsize>(ready));
      written_to += static_cast<std::streamoff>(ready);
      pending.erase(0, ready);
    }
    file->flush();
    const bool is_written = static_cast<bool>(*file);
    file.reset();
    return is_written && shorten_file(name_, static_cast<std::uint64_t>(written_to));
  }

 private:
  std::string name_;
};

}  // namespace

std::shared_ptr<TextStore> file_store(std::string name) {
  return std::make_shared<FileStore>(std::move(name));
}

}  // namespace unflex::platform
