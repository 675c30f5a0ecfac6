#include "unflex/gcode/feature.hpp"

#include <algorithm>
#include <utility>

#include "characters.hpp"

namespace unflex::gcode {
namespace {

using Kind = FeatureKind;
using Name = std::pair<std::string_view, Kind>;

// Names of features as folded() gives them.
//
// PrusaSlicer, SuperSlicer, Slic3r: src/libslic3r/ExtrusionEntity.cpp, role_to_string(). Orca and
// Bambu Studio: the same file. Cura: CuraEngine, src/gcodeExport.cpp, writeTypeComment().
// Simplify3D and ideaMaker: their output.
//
// Cura has one name for skins above and below. An overhang may belong to a wall of any kind and is
// printed as a bridge is. A thin wall is seen from outside.
constexpr std::array kNames = {
    Name{"external perimeter", Kind::outer_wall},
    Name{"outer wall", Kind::outer_wall},
    Name{"wall outer", Kind::outer_wall},
    Name{"outer perimeter", Kind::outer_wall},
    Name{"thin wall", Kind::outer_wall},
    Name{"external single extrusion", Kind::outer_wall},
    Name{"perimeter", Kind::inner_wall},
    Name{"internal perimeter", Kind::inner_wall},
    Name{"inner wall", Kind::inner_wall},
    Name{"wall inner", Kind::inner_wall},
    Name{"inner perimeter", Kind::inner_wall},
    Name{"internal infill", Kind::infill},
    Name{"sparse infill", Kind::infill},
    Name{"fill", Kind::infill},
    Name{"infill", Kind::infill},
    Name{"gap fill", Kind::infill},
    Name{"gap infill", Kind::infill},
    Name{"internal single extrusion", Kind::infill},
    Name{"solid infill", Kind::solid_infill},
    Name{"internal solid infill", Kind::solid_infill},
    Name{"bottom surface", Kind::solid_infill},
    Name{"solid layer", Kind::solid_infill},
    Name{"solid fill", Kind::solid_infill},
    Name{"top solid infill", Kind::top},
    Name{"top surface", Kind::top},
    Name{"ironing", Kind::top},
    Name{"skin", Kind::top},
    Name{"bridge infill", Kind::bridge},
    Name{"internal bridge infill", Kind::bridge},
    Name{"bridge", Kind::bridge},
    Name{"internal bridge", Kind::bridge},
    Name{"overhang perimeter", Kind::bridge},
    Name{"overhang wall", Kind::bridge},
    Name{"support", Kind::support},
    Name{"support material", Kind::support},
    Name{"support material interface", Kind::support},
    Name{"support interface", Kind::support},
    Name{"support transition", Kind::support},
    Name{"dense support", Kind::support},
    Name{"raft", Kind::support},
    Name{"skirt", Kind::skirt},
    Name{"skirt/brim", Kind::skirt},
    Name{"brim", Kind::skirt},
};

// Slicers differ in capitals and in what joins words.
char folded(char c) {
  if (c == '-' || c == '_') {
    return ' ';
  }
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::optional<FeatureKind> feature_by_word(std::string_view word) {
  const auto found = std::ranges::find(kFeatureWords, word);
  return found == kFeatureWords.end()
             ? std::nullopt
             : std::optional(static_cast<FeatureKind>(found - kFeatureWords.begin()));
}

std::optional<std::string_view> feature_name(std::string_view line) {
  if (!line.starts_with(';')) {
    return std::nullopt;
  }
  const std::string_view comment = trimmed(line.substr(1));
  for (const std::string_view prefix : {"TYPE:", "FEATURE:", "feature "}) {
    if (comment.starts_with(prefix)) {
      return trimmed(comment.substr(prefix.size()));
    }
  }
  return std::nullopt;
}

FeatureKind feature_by_name(std::string_view name) {
  const auto found = std::ranges::find_if(kNames, [&](const Name& known) {
    return std::ranges::equal(known.first, name, {}, {}, folded);
  });
  return found == kNames.end() ? Kind::other : found->second;
}

}  // namespace unflex::gcode
