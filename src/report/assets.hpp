// The files of assets/, which the build turns into constants (cmake/EmbedText.cmake).
#pragma once

#include <string_view>

namespace unflex::report::assets {

extern const std::string_view page_css;
extern const std::string_view page_js;

}  // namespace unflex::report::assets
