// The files of assets/, which the build turns into constants (cmake/EmbedText.cmake). Each adds
// something to the frame of all pages. A blank line at its beginning sets it apart there.
#pragma once

#include <string_view>

namespace unflex::study::assets {

extern const std::string_view study_css;
// Shows the figures of the chosen case by the chosen method. Cases 5A and 5B differ from the
// reference only in the thesis' own methods. Other methods have no figures there.
extern const std::string_view study_js;

extern const std::string_view fastest_css;
extern const std::string_view machines_css;

}  // namespace unflex::study::assets
