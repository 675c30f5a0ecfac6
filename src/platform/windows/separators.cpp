#include "../separators.hpp"

namespace unflex::platform {

const std::string_view kSeparators = "/\\";

std::size_t root_length(std::string_view name) {
  const std::size_t drive = name.size() > 1 && name[1] == ':' ? 2 : 0;
  const std::size_t root = name.find_first_not_of(kSeparators, drive);
  return root == std::string_view::npos ? name.size() : root;
}

}  // namespace unflex::platform
