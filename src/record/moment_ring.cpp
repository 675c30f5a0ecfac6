#include "moment_ring.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::record {
namespace {

constexpr std::size_t kEntries = 8192;
// Number of moments before a place, and as many after it.
constexpr std::size_t kHalf = 75;

}  // namespace

MomentRing::MomentRing(double half_width_s)
    : interval_s_(half_width_s / static_cast<double>(kHalf)), entries_(kEntries) {}

void MomentRing::add(const verify::NozzleStep& step, const PathPoint& where) {
  last_s_ = clock_s_;
  Entry& entry = entries_[count_++ % entries_.size()];
  entry.where = where;
  report::Moment& moment = entry.moment;
  moment.time_s = clock_s_;
  moment.contour_mm = std::sqrt(step.contour2_mm2);
  moment.base_mm = dynamics::place_mm(step.base);
  moment.reference_mm = step.measured ? step.reference_mm : moment.base_mm;
  moment.nozzle_mm = dynamics::place_mm(step.nozzle);
}

void MomentRing::cancel(std::size_t id) {
  std::erase_if(requests_, [&](const Request& request) { return request.id == id; });
}

// The first entry at or behind the place; count_ if there is none yet.
std::size_t MomentRing::find(const PathPoint& where) const {
  std::size_t from = begin();
  std::size_t to = count_;
  while (from < to) {
    const std::size_t middle = from + (to - from) / 2;
    if (at(middle).where < where) {
      from = middle + 1;
    } else {
      to = middle;
    }
  }
  return from;
}

std::vector<report::Moment> MomentRing::around(std::size_t centre) const {
  const report::Moment origin = at(centre).moment;
  const std::size_t from = std::max(begin(), centre - std::min(centre, kHalf));
  const std::size_t to = std::min(count_, centre + kHalf + 1);
  std::vector<report::Moment> result;
  result.reserve(to - from);
  for (std::size_t i = from; i < to; ++i) {
    report::Moment moment = at(i).moment;
    moment.time_s -= origin.time_s;
    result.push_back(moment);
  }
  return result;
}

std::vector<MomentRing::Taken> MomentRing::take(bool over) {
  std::vector<Taken> taken;
  std::erase_if(requests_, [&](const Request& request) {
    const std::size_t centre = find(request.where);
    const bool gone = begin() > 0 && centre == begin();
    if (!over && !gone && count_ <= centre + kHalf) {
      return false;
    }
    taken.push_back({request.id, {}});
    if (!gone && centre < count_) {
      taken.back().moments = around(centre);
    }
    return true;
  });
  return taken;
}

}  // namespace unflex::record
