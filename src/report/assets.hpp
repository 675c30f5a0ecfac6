// The files of assets/, which the build turns into constants (cmake/EmbedText.cmake).
#pragma once

#include <string_view>

namespace unflex::report::assets {

extern const std::string_view colours_css;
extern const std::string_view page_css;
extern const std::string_view page_js;

// For the report of a print.
extern const std::string_view report_css;
extern const std::string_view report_html;
extern const std::string_view plot_js;
extern const std::string_view paths_js;
extern const std::string_view layers_js;
extern const std::string_view moment_js;
extern const std::string_view report_js;

}  // namespace unflex::report::assets
