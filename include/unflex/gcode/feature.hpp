// Slicers' comments about the lines that follow: the kind of feature that the lines lay.
//
//   ;TYPE:External perimeter    PrusaSlicer, SuperSlicer, OrcaSlicer, Cura, ideaMaker
//   ; FEATURE: Outer wall       Bambu Studio        ; feature outer perimeter   Simplify3D
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace unflex::gcode {

enum class FeatureKind : unsigned char {
  outer_wall,
  inner_wall,
  infill,
  solid_infill,
  top,
  bridge,
  support,
  skirt,
  travel,  // no filament; never named by a slicer
  other,
};

// In the order of the enumeration.
inline constexpr std::array<std::string_view, 10> kFeatureWords = {
    "outer_wall", "inner_wall", "infill", "solid_infill", "top",
    "bridge",     "support",    "skirt",  "travel",       "other"};

// The kind that one of these words stands for; nullopt: none.
[[nodiscard]] std::optional<FeatureKind> feature_by_word(std::string_view word);

// The slicer's name of the feature that begins behind this line, without its ending; nullopt: the
// line says nothing of features.
[[nodiscard]] std::optional<std::string_view> feature_name(std::string_view line);

// The kind that a slicer's name stands for, in capitals or not. Names that no slicer is known for
// are `other`.
[[nodiscard]] FeatureKind feature_by_name(std::string_view name);

}  // namespace unflex::gcode
