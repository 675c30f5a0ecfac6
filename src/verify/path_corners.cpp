#include "path_corners.hpp"

#include <algorithm>

namespace unflex::verify {

void PathCorners::begin(const ReferencePath& path) {
  piece_ = path.end();
  while (piece_ > path.first() && path[piece_ - 1].section == path.section()) {
    --piece_;
  }
}

void PathCorners::begin_section(const ReferencePath& path, double clock_back_s) {
  section_ = path.section();
  set_clock_back(clock_back_s);
}

// Pieces of a later section are on a clock that begin_section() will tell.
void PathCorners::follow(const ReferencePath& path) {
  piece_ = std::max(piece_, path.first());
  while (piece_ < path.end() && path[piece_].section <= section_) {
    const PathPiece& piece = path[piece_++];
    gauge_.follow(piece.move, piece.start_s + shift_s_, piece.end_s + shift_s_);
  }
}

// Between two looks the nozzle goes in a curve, of which the middle shows enough.
void PathCorners::pass(double time_s, const dynamics::NozzleMotionXY& from,
                       const dynamics::NozzleMotionXY& to, double h) {
  const double now_s = time_s + shift_s_;
  if (gauge_.is_near(now_s - 0.5 * h)) {
    const auto middle = [&](const dynamics::NozzleMotion& a, const dynamics::NozzleMotion& b) {
      return 0.5 * (a.position + b.position) + 0.125 * h * (a.velocity - b.velocity);
    };
    gauge_.sample(now_s - 0.5 * h, map_axes(middle, from, to));
  }
  gauge_.sample(now_s, dynamics::place_mm(to));
}

}  // namespace unflex::verify
