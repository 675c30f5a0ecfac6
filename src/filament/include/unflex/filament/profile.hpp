// How much material a filament's section holds, along the spool.
//
//   s      place along the filament, mm from its free end
//   A(s)   area of the section that is material, mm²
//   V      volume, mm³
#pragma once

#include <istream>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::filament {

// The area of a full section, mm².
[[nodiscard]] double area_of_diameter_mm2(double diameter_mm);

// A(s): linear between places that were measured, and as at the first and the last one beyond.
class Profile {
 public:
  // One section everywhere. area_mm2 > 0.
  explicit Profile(double area_mm2);

  // Reads a table: a line with the names mm and area_mm2 or diameter_mm, then a line for each
  // place, in their order. Commas, semicolons, tabs or blanks stand between columns, and lines that
  // begin with # are comments. Errors are of kind input and name the line.
  [[nodiscard]] static Result<Profile> read(std::istream& table, const std::string& name);

  [[nodiscard]] double area_mm2(double at_mm) const;
  // The length from a place on that holds the volume: ∫ A ds = V. volume_mm3 ≥ 0.
  [[nodiscard]] double length_mm(double from_mm, double volume_mm3) const;
  // The volume from one place to another; negative if that comes before.
  [[nodiscard]] double volume_mm3(double from_mm, double to_mm) const;

 private:
  struct Place {
    double at_mm = 0.0;
    double area_mm2 = 0.0;
    double before_mm3 = 0.0;  // the volume from the first place to this one
  };

  explicit Profile(std::vector<Place> places) : places_(std::move(places)) {}

  // The volume from the first place to this one, negative before it.
  [[nodiscard]] double volume_to_mm3(double at_mm) const;

  std::vector<Place> places_;
};

}  // namespace unflex::filament
