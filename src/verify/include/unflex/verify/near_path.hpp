// The part of the reference's path that the nozzle can be near at a time.
//
// Notation:
//   r, p   reference and nozzle      τ   reach: how far from its time the path counts as near, s
//   contour error   the distance from p(t) to r([t − τ, t + τ])
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "unflex/core/xy.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/nearest_along.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

// The reach τ for a nozzle.
[[nodiscard]] double reach_s(const NozzleModel& model);

// Asked at increasing times. A time may go back a little, as far as the path still holds its
// pieces.
class NearPath {
 public:
  explicit NearPath(double reach_s) : reach_s_(reach_s) {}

  // From now on looks at this path.
  void begin(const ReferencePath& path);
  // Moves on to time t. The path must hold the piece at t.
  void slide(const ReferencePath& path, double t);
  // Squared contour error of a nozzle at p at the time of the last slide(). `nearest` becomes the
  // number of the nearest piece.
  [[nodiscard]] double squared_contour_error(const ReferencePath& path, const XY& p_mm,
                                             std::size_t& nearest);
  [[nodiscard]] double reach_s() const { return reach_s_; }

  // A piece of the path within reach: where it begins, and its direction and length in X and Y.
  struct Span {
    XY start_mm;
    XY direction;
    double length_mm = 0.0;
    double start_s = 0.0;
    double end_s = 0.0;
  };
  // All spans, by time. The first one belongs to piece number first().
  [[nodiscard]] const Span* spans() const { return spans_.data() + dropped_; }
  [[nodiscard]] std::size_t span_count() const { return end_ - first_; }
  [[nodiscard]] std::size_t first() const { return first_; }
  // Whether the first span begins before t − τ, and whether the last ends after t + τ. Such spans
  // count only from begin_mm() on and up to end_mm(). These two take long to find. They are not
  // needed for a place behind begin_bound_mm() and before end_bound_mm().
  [[nodiscard]] bool begins_cut() const { return spans()->start_s < time_s_ - reach_s_; }
  [[nodiscard]] bool ends_cut() const {
    return spans()[span_count() - 1].end_s > time_s_ + reach_s_;
  }
  [[nodiscard]] double begin_bound_mm(const ReferencePath& path);
  [[nodiscard]] double begin_mm(const ReferencePath& path) const;
  [[nodiscard]] double end_bound_mm(const ReferencePath& path);
  [[nodiscard]] double end_mm(const ReferencePath& path) const;

 private:
  // Remembers for a while where a piece of the path is cut at t − τ or t + τ.
  class Cut {
   public:
    // Length of the piece covered at t + ahead_s, or up to kCutKept_s earlier.
    double at(const PathPiece& piece, std::size_t number, double t, double ahead_s);

   private:
    std::size_t piece_ = std::numeric_limits<std::size_t>::max();
    double until_s_ = 0.0;
    double covered_mm_ = 0.0;
  };

  // How long a remembered cut is used.
  static constexpr double kCutKept_s = 1e-3;

  double reach_s_;
  double time_s_ = 0.0;
  void add_span(const PathPiece& piece);
  void drop_span();

  std::size_t first_ = 0;  // pieces that reach into [t − τ, t + τ]
  std::size_t end_ = 0;
  // The pieces within reach, from dropped_ on. In the path their data lie far apart in memory.
  std::vector<Span> spans_;
  std::size_t dropped_ = 0;
  Cut first_cut_;
  Cut last_cut_;
};

// Inline for speed: a verification spends most of its time here.

inline double NearPath::Cut::at(const PathPiece& piece, std::size_t number, double t,
                                double ahead_s) {
  // The clock may go back.
  if (number != piece_ || t > until_s_ || t < until_s_ - kCutKept_s) {
    piece_ = number;
    until_s_ = t + kCutKept_s;
    covered_mm_ = piece.covered_xy_mm(t + ahead_s);
  }
  return covered_mm_;
}

inline void NearPath::slide(const ReferencePath& path, double t) {
  time_s_ = t;
  while (first_ < path.first()) {
    drop_span();
  }
  while (path[first_].end_s < t - reach_s_ && first_ + 1 < path.end()) {
    drop_span();
  }
  while (end_ <= first_ || (end_ < path.end() && path[end_].start_s <= t + reach_s_)) {
    add_span(path[end_]);
  }
}

// Pieces count whole, except that the first and the last are cut at t ± τ. The exact cut is
// computed only if the nearest point is close to it.
inline double NearPath::squared_contour_error(const ReferencePath& path, const XY& p_mm,
                                              std::size_t& nearest) {
  const bool is_begin_cut = begins_cut();
  const bool is_end_cut = ends_cut();
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t number = first_; number < end_; ++number) {
    const Span& span = spans()[number - first_];
    const XY off_mm = p_mm - span.start_mm;
    double along = nearest_along_mm(off_mm, span.direction, span.length_mm);
    if (is_begin_cut && number == first_ && along < begin_bound_mm(path)) {
      along = std::max(along, begin_mm(path));
    }
    if (is_end_cut && number + 1 == end_ && along > end_bound_mm(path)) {
      along = std::min(along, end_mm(path));
    }
    const double distance2 = distance2_mm2(off_mm, span.direction, along);
    if (distance2 < best) {
      best = distance2;
      nearest = number;
    }
  }
  return best;
}

}  // namespace unflex::verify
