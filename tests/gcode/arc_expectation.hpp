// What every arc must look like, whichever firmware cuts it.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "interpreting.hpp"

namespace unflex::gcode {

struct ExpectedArc {
  double centre_x_mm;
  double centre_y_mm;
  double radius_mm;
  double angle_rad;  // with its sign: positive anticlockwise
  std::size_t pieces;
  double tolerance_mm = 1e-9;  // tolerance of the radius
};

// Expects equal angles about the centre, and filament and Z in equal shares.
inline void expect_arc(const Event& event, const ExpectedArc& arc) {
  ASSERT_EQ(event.kind, EventKind::move);
  ASSERT_EQ(event.segments.size(), arc.pieces);
  const Position start = event.segments.front().start_mm;
  const Position end = event.segments.back().end_mm;
  const double first = std::atan2(start[Y] - arc.centre_y_mm, start[X] - arc.centre_x_mm);
  for (std::size_t i = 0; i + 1 < arc.pieces; ++i) {
    const double share = static_cast<double>(i + 1) / static_cast<double>(arc.pieces);
    const double at = first + arc.angle_rad * share;
    const Position& point = event.segments[i].end_mm;
    ASSERT_NEAR(point[X], arc.centre_x_mm + arc.radius_mm * std::cos(at), arc.tolerance_mm) << i;
    ASSERT_NEAR(point[Y], arc.centre_y_mm + arc.radius_mm * std::sin(at), arc.tolerance_mm) << i;
    ASSERT_NEAR(point[Z], start[Z] + (end[Z] - start[Z]) * share, 1e-9) << i;
    ASSERT_NEAR(point[E], start[E] + (end[E] - start[E]) * share, 1e-9) << i;
  }
}

}  // namespace unflex::gcode
