#include "unflex/gcode/layer_mark.hpp"

#include <algorithm>

#include "characters.hpp"

namespace unflex::gcode {
namespace {}  // namespace

bool begins_layer(std::string_view line) {
  if (!line.starts_with(';')) {
    return false;
  }
  const std::string_view comment = trimmed(line.substr(1));
  if (comment == "LAYER_CHANGE" || comment == "CHANGE_LAYER") {
    return true;
  }
  for (const std::string_view mark : {"LAYER:", "layer "}) {
    if (comment.starts_with(mark)) {
      const std::string_view number = trimmed(comment.substr(mark.size()));
      return !number.empty() && (is_digit(number.front()) || number.front() == '-');
    }
  }
  return false;
}

}  // namespace unflex::gcode
