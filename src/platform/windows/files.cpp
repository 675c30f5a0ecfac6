#include "unflex/platform/files.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "utf16.hpp"

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;

// Whether the set in square brackets at the pattern's beginning has the character. Moves the
// pattern up to behind the closing bracket. Without a closing bracket the opening one stands for
// itself.
bool matches_set(std::string_view& pattern, char character) {
  const std::size_t end = pattern.find(']', 2);
  if (end == std::string_view::npos) {
    pattern.remove_prefix(1);
    return character == '[';
  }
  std::string_view set = pattern.substr(1, end - 1);
  pattern.remove_prefix(end + 1);
  const bool is_negated = set.starts_with('!') || set.starts_with('^');
  set.remove_prefix(is_negated ? 1 : 0);
  bool is_named = false;
  while (!set.empty()) {
    const bool is_range = set.size() > 2 && set[1] == '-';
    is_named =
        is_named || (is_range ? set[0] <= character && character <= set[2] : set[0] == character);
    set.remove_prefix(is_range ? 3 : 1);
  }
  return is_named != is_negated;
}

bool matches(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) {
    return name.empty();
  }
  if (pattern.front() == '*') {
    return matches(pattern.substr(1), name) || (!name.empty() && matches(pattern, name.substr(1)));
  }
  if (name.empty()) {
    return false;
  }
  bool is_same = pattern.front() == '?' || pattern.front() == name.front();
  if (pattern.front() == '[') {
    is_same = matches_set(pattern, name.front());
  } else {
    pattern.remove_prefix(1);
  }
  return is_same && matches(pattern, name.substr(1));
}

bool is_pattern(std::string_view name) {
  return name.find_first_of("*?[") != std::string_view::npos;
}

}  // namespace

std::unique_ptr<std::istream> read_file(const std::string& name) {
  return std::make_unique<std::ifstream>(path_of(name), std::ios::binary);
}

std::unique_ptr<std::ostream> write_file(const std::string& name) {
  return std::make_unique<std::ofstream>(path_of(name), std::ios::binary | std::ios::trunc);
}

std::unique_ptr<std::iostream> change_file(const std::string& name) {
  return std::make_unique<std::fstream>(path_of(name),
                                        std::ios::in | std::ios::out | std::ios::binary);
}

bool shorten_file(const std::string& name, std::uint64_t bytes) {
  std::error_code error;
  fs::resize_file(path_of(name), bytes, error);
  return !error;
}

std::optional<std::uint64_t> file_bytes(const std::string& name) {
  std::error_code unknown;
  const std::uintmax_t bytes = fs::file_size(path_of(name), unknown);
  return unknown ? std::nullopt : std::optional<std::uint64_t>(bytes);
}

bool exists(const std::string& name) {
  std::error_code ignored;
  return fs::exists(path_of(name), ignored);
}

bool is_directory(const std::string& name) {
  std::error_code ignored;
  return fs::is_directory(path_of(name), ignored);
}

// Patterns in the last part of a name alone.
std::vector<std::string> matching_files(const std::string& pattern) {
  std::error_code error;
  if (!is_pattern(pattern)) {
    return fs::symlink_status(path_of(pattern), error).type() != fs::file_type::not_found
               ? std::vector{pattern}
               : std::vector<std::string>{};
  }
  const fs::path path = path_of(pattern);
  const std::string last = name_of(path.filename());
  const fs::path folder = path.parent_path();
  std::vector<std::string> files;
  fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = name_of(entry->path().filename());
    if (!name.starts_with('.') && matches(last, name)) {
      files.push_back(name_of(folder / entry->path().filename()));
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string canonical_name(const std::string& name) {
  std::error_code failed;
  const fs::path whole = fs::absolute(path_of(name), failed);
  const fs::path canonical = failed ? whole : fs::weakly_canonical(whole, failed);
  return failed ? name : name_of(canonical);
}

std::string name_beside(const std::string& name, std::string_view other) {
  return name_of(path_of(name).parent_path() / path_of(other));
}

}  // namespace unflex::platform
