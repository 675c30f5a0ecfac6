// Base64 (RFC 4648, section 4): bytes as text, as thumbnails stand in comments and paths in pages.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace unflex {

[[nodiscard]] std::string to_base64(std::string_view bytes);

// nullopt if the text is no base64 of whole groups of four.
[[nodiscard]] std::optional<std::string> from_base64(std::string_view text);

}  // namespace unflex
