// WASI as browsers and node have it. Debian's C++ library for it knows no files, so C's are used.
#include "unflex/platform/files.hpp"

#include <dirent.h>
#include <fnmatch.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <istream>
#include <ostream>
#include <streambuf>
#include <utility>

namespace unflex::platform {
namespace {

class FileBuffer final : public std::streambuf {
 public:
  FileBuffer(const std::string& name, const char* mode) : file_(std::fopen(name.c_str(), mode)) {}
  FileBuffer(const FileBuffer&) = delete;
  FileBuffer& operator=(const FileBuffer&) = delete;
  ~FileBuffer() override {
    if (file_ != nullptr) {
      std::fclose(file_);
    }
  }
  [[nodiscard]] bool is_open() const { return file_ != nullptr; }

 protected:
  int_type underflow() override {
    if (!is_open()) {
      return traits_type::eof();
    }
    const std::size_t count = std::fread(block_.data(), 1, block_.size(), file_);
    setg(block_.data(), block_.data(), block_.data() + count);
    return count == 0 ? traits_type::eof() : traits_type::to_int_type(*gptr());
  }
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    if (!is_open()) {
      return 0;
    }
    forget_read();
    return static_cast<std::streamsize>(
        std::fwrite(text, 1, static_cast<std::size_t>(count), file_));
  }
  int_type overflow(int_type character) override {
    if (traits_type::eq_int_type(character, traits_type::eof())) {
      return traits_type::not_eof(character);
    }
    const char text = traits_type::to_char_type(character);
    return xsputn(&text, 1) == 1 ? character : traits_type::eof();
  }
  int sync() override { return is_open() ? std::fflush(file_) : -1; }
  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode /*which*/) override {
    if (!is_open()) {
      return pos_type(off_type(-1));
    }
    forget_read();
    const int origin =
        from == std::ios::beg ? SEEK_SET : (from == std::ios::cur ? SEEK_CUR : SEEK_END);
    return std::fseek(file_, static_cast<long>(offset), origin) == 0 ? pos_type(std::ftell(file_))
                                                                     : pos_type(off_type(-1));
  }
  pos_type seekpos(pos_type place, std::ios::openmode which) override {
    return seekoff(off_type(place), std::ios::beg, which);
  }

 private:
  // The file's place is ahead of the reader's by the bytes that the reader has not taken yet.
  void forget_read() {
    if (gptr() != egptr()) {
      std::fseek(file_, static_cast<long>(gptr() - egptr()), SEEK_CUR);
    }
    setg(nullptr, nullptr, nullptr);
  }

  std::FILE* file_;
  std::array<char, 65536> block_{};
};

// A stream that owns its file.
template <class Stream>
class FileStream final : public Stream {
 public:
  FileStream(const std::string& name, const char* mode) : Stream(nullptr), buffer_(name, mode) {
    this->rdbuf(&buffer_);
    if (!buffer_.is_open()) {
      this->setstate(std::ios::failbit);
    }
  }

 private:
  FileBuffer buffer_;
};

std::pair<std::string, std::string> folder_and_name(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? std::pair{std::string(), path}
                                    : std::pair{path.substr(0, slash + 1), path.substr(slash + 1)};
}

}  // namespace

std::unique_ptr<std::istream> read_file(const std::string& name) {
  return std::make_unique<FileStream<std::istream>>(name, "rb");
}

std::unique_ptr<std::ostream> write_file(const std::string& name) {
  return std::make_unique<FileStream<std::ostream>>(name, "wb");
}

std::unique_ptr<std::iostream> change_file(const std::string& name) {
  return std::make_unique<FileStream<std::iostream>>(name, "r+b");
}

bool shorten_file(const std::string& name, std::uint64_t bytes) {
  return ::truncate(name.c_str(), static_cast<off_t>(bytes)) == 0;
}

std::optional<std::uint64_t> file_bytes(const std::string& name) {
  struct stat status {};
  return ::stat(name.c_str(), &status) == 0
             ? std::optional(static_cast<std::uint64_t>(status.st_size))
             : std::nullopt;
}

bool exists(const std::string& name) { return file_bytes(name).has_value(); }

bool is_directory(const std::string& name) {
  struct stat status {};
  return ::stat(name.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

// Only the last part of a name may be a pattern.
std::vector<std::string> matching_files(const std::string& pattern) {
  if (pattern.find_first_of("*?[") == std::string::npos) {
    return exists(pattern) ? std::vector{pattern} : std::vector<std::string>{};
  }
  const auto [folder, name] = folder_and_name(pattern);
  std::vector<std::string> files;
  if (DIR* const all = ::opendir(folder.empty() ? "." : folder.c_str())) {
    while (const dirent* const entry = ::readdir(all)) {
      if (::fnmatch(name.c_str(), entry->d_name, FNM_PERIOD) == 0) {
        files.push_back(folder + entry->d_name);
      }
    }
    ::closedir(all);
  }
  std::sort(files.begin(), files.end());
  return files;
}

// A name that counts from the current folder stays so, since that folder is not known. Only links
// in the last part of a name are followed.
std::string canonical_name(const std::string& name) {
  std::string at = name;
  std::array<char, 4096> target{};
  for (int links = 0; links < 40; ++links) {
    const ssize_t length = ::readlink(at.c_str(), target.data(), target.size());
    if (length < 0) {
      break;
    }
    at = name_beside(at, {target.data(), static_cast<std::size_t>(length)});
  }
  std::vector<std::string_view> parts;
  for (std::string_view rest = at; !rest.empty();) {
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    const std::string_view part = rest.substr(0, slash);
    rest.remove_prefix(std::min(slash + 1, rest.size()));
    if (part == ".." && !parts.empty() && parts.back() != "..") {
      parts.pop_back();
    } else if (!part.empty() && part != ".") {
      parts.push_back(part);
    }
  }
  std::string result = at.starts_with('/') ? "/" : "";
  for (const std::string_view part : parts) {
    result.append(result.empty() || result == "/" ? "" : "/").append(part);
  }
  return result;
}

std::string name_beside(const std::string& name, std::string_view other) {
  return other.starts_with('/') ? std::string(other)
                                : folder_and_name(name).first + std::string(other);
}

}  // namespace unflex::platform
