#include "utf16.hpp"

#include <windows.h>

#include <cerrno>
#include <system_error>

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestShortName = 240;

}  // namespace

// The system takes names of more than 260 characters only with this beginning and when they are
// whole.
fs::path path_of(std::string_view name) {
  fs::path path(std::u8string(name.begin(), name.end()));
  if (path.native().size() < kLongestShortName || name.starts_with("\\\\")) {
    return path;
  }
  std::error_code failed;
  const fs::path whole = fs::absolute(path, failed).lexically_normal().make_preferred();
  return failed ? path : fs::path(L"\\\\?\\" + whole.native());
}

std::string name_of(const fs::path& path) {
  std::wstring_view name = path.native();
  if (name.starts_with(L"\\\\?\\")) {
    name.remove_prefix(4);
  }
  const std::u8string text = fs::path(name).generic_u8string();
  return {text.begin(), text.end()};
}

std::string utf8(std::wstring_view text) {
  const std::u8string result = fs::path(text).u8string();
  return {result.begin(), result.end()};
}

int last_error() {
  const std::error_code error(static_cast<int>(GetLastError()), std::system_category());
  const std::error_condition condition = error.default_error_condition();
  errno = GetLastError() == ERROR_SHARING_VIOLATION ? EBUSY
          : condition.category() == std::generic_category() && condition.value() != 0
              ? condition.value()
              : EIO;
  return errno;
}

}  // namespace unflex::platform
