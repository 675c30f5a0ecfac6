#include "section_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tunings.hpp"
#include "unflex/core/math.hpp"

namespace unflex::timing {
namespace {

using Tuned = OptimalTunings;

double u_of(const SectionNodes::Pin& pin) { return static_cast<double>(pin.k) + pin.x; }

}  // namespace

XY start_of(const Leg& leg) { return xy_of(leg.move.segment.start_mm); }

XY direction_of(const Leg& leg) { return xy_of(leg.move.direction); }

SectionNodes::SectionNodes(const Section& section, double node_s) : legs_(section.legs) {
  std::vector<double> begins_s = {0.0};
  for (const Leg& leg : legs_) {
    begins_s.push_back(begins_s.back() + leg.move.duration_s());
  }
  const double duration_s = begins_s.back();
  periods_ =
      std::max(Tuned::kFewestPeriods, static_cast<std::size_t>(std::lround(duration_s / node_s)));
  // A short section is begun more slowly.
  period_s_ = duration_s / static_cast<double>(periods_);
  std::size_t leg = 0;
  for (std::size_t node = 0; node <= periods_; ++node) {
    const double t = static_cast<double>(node) * period_s_;
    while (leg + 1 < legs_.size() && t >= begins_s[leg + 1]) {
      ++leg;
    }
    places_.push_back(xy_of(legs_[leg].move.position_mm(t - begins_s[leg])));
  }
  for (double& begin : begins_s) {
    begin /= period_s_;
  }
  bind(begins_s);
  period_s_ = std::max(period_s_, periods_ == Tuned::kFewestPeriods ? node_s : 0.0);
}

void SectionNodes::bind(const std::vector<double>& begins) {
  double turned_rad = 0.0;
  for (std::size_t i = 1; i < legs_.size(); ++i) {
    const XY a = direction_of(legs_[i - 1]);
    const XY b = direction_of(legs_[i]);
    turned_rad += std::abs(math::atan2(cross(a, b), dot(a, b)));
    const bool is_border = legs_[i - 1].lays_filament != legs_[i].lays_filament ||
                           !have_same_feed(legs_[i - 1], legs_[i]) ||
                           legs_[i - 1].tolerance_mm != legs_[i].tolerance_mm ||
                           std::isfinite(legs_[i].entry_mm_s);
    if (is_border || turned_rad > Tuned::kTurn_rad) {
      turned_rad = 0.0;
      const auto k = std::min(static_cast<std::size_t>(begins[i]), periods_ - 1);
      pins_.push_back({i, k, begins[i] - static_cast<double>(k)});
    }
  }
  std::size_t next = 0;
  for (std::size_t k = 0; k <= periods_; ++k) {
    while (next < pins_.size() && pins_[next].k < k) {
      ++next;
    }
    first_pin_.push_back(next);
  }
}

SectionNodes::Range SectionNodes::legs(std::size_t k, double x) const {
  std::size_t next = first_pin_[k];
  while (next < pins_.size() && pins_[next].k == k && pins_[next].x <= x) {
    ++next;
  }
  return {next > 0 ? pins_[next - 1].vertex : 0,
          next < pins_.size() ? pins_[next].vertex - 1 : legs_.size() - 1};
}

double SectionNodes::along_mm(std::size_t leg, XY nozzle) const {
  return timing::along_mm(legs_[leg].move, nozzle);
}

std::size_t SectionNodes::nearest_leg(std::size_t k, double x, XY nozzle) const {
  const Range range = legs(k, x);
  std::size_t nearest = range.first;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t leg = range.first; leg <= range.last; ++leg) {
    const double distance = distance_mm(legs_[leg].move, nozzle);
    if (distance < least) {
      least = distance;
      nearest = leg;
    }
  }
  return nearest;
}

double SectionNodes::error_mm(std::size_t k, double x, XY nozzle) const {
  Range range = legs(k, x);
  // Near a bound vertex the nozzle may be nearer to the leg behind it.
  if (range.first > 0 && is_near_vertex(range.first, k, x)) {
    --range.first;
  }
  if (range.last + 1 < legs_.size() && is_near_vertex(range.last + 1, k, x)) {
    ++range.last;
  }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t leg = range.first; leg <= range.last; ++leg) {
    least = std::min(least, distance_mm(legs_[leg].move, nozzle));
  }
  return least;
}

bool SectionNodes::is_near_vertex(std::size_t vertex, std::size_t k, double x) const {
  const auto pin = std::ranges::lower_bound(pins_, vertex, {}, &Pin::vertex);
  return pin != pins_.end() && pin->vertex == vertex &&
         std::abs(u_of(*pin) - static_cast<double>(k) - x) <= Tuned::kNearVertex;
}

double SectionNodes::tolerance_mm(std::size_t leg, std::size_t k, double x, double beside) const {
  double tolerance = legs_[leg].tolerance_mm - legs_[leg].bulge_mm;
  if (legs_[leg].lays_filament) {
    return tolerance;
  }
  const double u = static_cast<double>(k) + x;
  constexpr std::size_t kReach = 3;
  for (std::size_t i = first_pin_[k > kReach ? k - kReach : 0];
       i < pins_.size() && u_of(pins_[i]) <= u + beside; ++i) {
    if (u_of(pins_[i]) >= u - beside) {
      for (const std::size_t other : {pins_[i].vertex - 1, pins_[i].vertex}) {
        if (legs_[other].lays_filament) {
          tolerance = std::min(tolerance, legs_[other].tolerance_mm);
        }
      }
    }
  }
  return tolerance;
}

double SectionNodes::feed_mm_s(std::size_t leg, std::size_t k, double x) const {
  double feed = legs_[leg].feed_mm_s;
  if (legs_[leg].lays_filament) {
    return feed;
  }
  const double u = static_cast<double>(k) + x;
  for (std::size_t i = first_pin_[k > 2 ? k - 2 : 0];
       i < pins_.size() && u_of(pins_[i]) <= u + Tuned::kBesideFeed; ++i) {
    if (u_of(pins_[i]) >= u - Tuned::kBesideFeed) {
      for (const std::size_t beside : {pins_[i].vertex - 1, pins_[i].vertex}) {
        if (legs_[beside].lays_filament) {
          feed = std::min(feed, legs_[beside].feed_mm_s);
        }
      }
    }
  }
  return feed;
}

}  // namespace unflex::timing
