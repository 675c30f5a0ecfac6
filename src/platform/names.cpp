#include "unflex/platform/names.hpp"

#include <algorithm>

#include "separators.hpp"

namespace unflex::platform {
namespace {

// Where the last part begins.
std::size_t beginning_of_last(std::string_view name) {
  const std::size_t at = name.find_last_of(kSeparators);
  return std::max(at == std::string_view::npos ? 0 : at + 1, root_length(name));
}

}  // namespace

std::string folder_of(std::string_view name) {
  std::size_t end = beginning_of_last(name);
  while (end > root_length(name) && kSeparators.find(name[end - 1]) != std::string_view::npos) {
    --end;
  }
  return std::string(name.substr(0, end));
}

std::string last_part(std::string_view name) {
  return std::string(name.substr(beginning_of_last(name)));
}

std::string ending_of(std::string_view name) {
  const std::string last = last_part(name);
  const std::size_t dot = last.rfind('.');
  return dot == std::string::npos || dot == 0 || last == ".." ? std::string() : last.substr(dot);
}

std::string with_ending(std::string_view name, std::string_view ending) {
  return std::string(name.substr(0, name.size() - ending_of(name).size())).append(ending);
}

std::string joined(std::string_view folder, std::string_view name) {
  if (folder.empty() || root_length(name) > 0) {
    return std::string(name);
  }
  const bool is_parted = kSeparators.find(folder.back()) != std::string_view::npos;
  return std::string(folder).append(is_parted ? "" : "/").append(name);
}

}  // namespace unflex::platform
