#include "unflex/platform/files.hpp"

#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;

}  // namespace

std::unique_ptr<std::istream> read_file(const std::string& name) {
  return std::make_unique<std::ifstream>(name, std::ios::binary);
}

std::unique_ptr<std::ostream> write_file(const std::string& name) {
  return std::make_unique<std::ofstream>(name, std::ios::binary | std::ios::trunc);
}

std::unique_ptr<std::iostream> change_file(const std::string& name) {
  return std::make_unique<std::fstream>(name, std::ios::in | std::ios::out | std::ios::binary);
}

bool shorten_file(const std::string& name, std::uint64_t bytes) {
  std::error_code error;
  fs::resize_file(name, bytes, error);
  return !error;
}

std::optional<std::uint64_t> file_bytes(const std::string& name) {
  std::error_code unknown;
  const std::uintmax_t bytes = fs::file_size(name, unknown);
  return unknown ? std::nullopt : std::optional<std::uint64_t>(bytes);
}

bool exists(const std::string& name) {
  std::error_code ignored;
  return fs::exists(name, ignored);
}

bool is_directory(const std::string& name) {
  std::error_code ignored;
  return fs::is_directory(name, ignored);
}

std::vector<std::string> matching_files(const std::string& pattern) {
  glob_t found{};
  static_cast<void>(::glob(pattern.c_str(), GLOB_NOSORT, nullptr, &found));
  std::vector<std::string> files(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  std::sort(files.begin(), files.end());
  return files;
}

std::string canonical_name(const std::string& name) {
  std::error_code failed;
  const fs::path whole = fs::absolute(name, failed);
  const fs::path canonical = failed ? whole : fs::weakly_canonical(whole, failed);
  return failed ? name : canonical.string();
}

std::string name_beside(const std::string& name, std::string_view other) {
  return (fs::path(name).parent_path() / other).string();
}

}  // namespace unflex::platform
