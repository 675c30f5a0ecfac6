// The comments by which slicers mark layers:
//
//   ;LAYER_CHANGE  ; CHANGE_LAYER  ;LAYER:12  ; layer 12, Z = 2.4
#pragma once

#include <string_view>

namespace unflex::gcode {

// Whether a line, without its ending, marks the begin of a layer.
[[nodiscard]] bool begins_layer(std::string_view line);

}  // namespace unflex::gcode
