#include "../separators.hpp"

namespace unflex::platform {

const std::string_view kSeparators = "/";

std::size_t root_length(std::string_view name) { return name.starts_with('/') ? 1 : 0; }

}  // namespace unflex::platform
