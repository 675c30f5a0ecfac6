// The contour error of extruding moves by the place where it arises: in squares of the bed, and in
// bands of height.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "unflex/core/xy.hpp"
#include "unflex/verify/measured.hpp"

namespace unflex::verify {

class PlaceGauge {
 public:
  // The mean of c² over weight_s seconds, with the nozzle at this place.
  void add(const XY& place_mm, double height_mm, double contour2_mm2, double weight_s);
  [[nodiscard]] PlaceErrors errors() const;

 private:
  struct Sum {
    double contour2_mm2_s = 0.0;
    double weight_s = 0.0;

    void add(double contour2_mm2, double of_s) {
      contour2_mm2_s += contour2_mm2 * of_s;
      weight_s += of_s;
    }
    [[nodiscard]] PartError error() const;
  };

  // By row and column of the square, and by the number of the band.
  std::map<std::pair<std::int32_t, std::int32_t>, Sum> squares_;
  std::map<std::int32_t, Sum> bands_;
};

}  // namespace unflex::verify
