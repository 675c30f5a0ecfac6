#include "bundle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "bundle_kernels.hpp"

namespace unflex::verify {
namespace {

// A state closer to even motion than this has come to it.
constexpr double kRests_mm = 1e-7;

}  // namespace

const BundleKernel& bundle_kernel() {
  return has_four_lanes() ? four_lanes_bundle() : two_lanes_bundle();
}

Bundle::Bundle(std::vector<NozzleModel> models)
    : models_(std::move(models)), kernel_(&bundle_kernel()) {
  arrays_.places = (models_.size() + kLanes - 1) / kLanes * kLanes;
  for (const NozzleModel& model : models_) {
    arrays_.modes = std::max({arrays_.modes, model.x.mode_count(), model.y.mode_count()});
    fastest_rad_s_ = std::max({fastest_rad_s_, model.x.fastest_rad_s(), model.y.fastest_rad_s()});
  }
  const std::size_t parts = arrays_.parts();
  for (std::vector<double>* of_modes :
       {&arrays_.stiffness_per_s2, &arrays_.damping_per_s, &arrays_.gain, &arrays_.lead_s}) {
    of_modes->assign(parts, 0.0);
  }
  arrays_.states.assign(2 * parts, 0.0);
  for (std::vector<double>& map : arrays_.maps) {
    map.assign(2 * parts, 0.0);
  }
  for (std::vector<double>* of_nozzles :
       {&arrays_.nearest, &arrays_.now_mm2, &arrays_.before_mm2, &arrays_.mean_mm2,
        &arrays_.largest_mm2, &all_.contour2_mm2_s, &all_.contour2_max_mm2,
        &extruding_.contour2_mm2_s, &extruding_.contour2_max_mm2}) {
    of_nozzles->assign(arrays_.places, 0.0);
  }
  arrays_.away.fill(std::vector<double>(arrays_.places));
  arrays_.was.fill(std::vector<double>(arrays_.places));
  for (std::size_t number = 0; number < models_.size(); ++number) {
    for (const std::size_t axis : {0U, 1U}) {
      const dynamics::FlexibleAxis& of = axis == 0 ? models_[number].x : models_[number].y;
      for (std::size_t mode = 0; mode < of.mode_count(); ++mode) {
        const dynamics::Mode& each = of.modes()[mode];
        const std::size_t place = arrays_.place(axis, mode) + number;
        arrays_.stiffness_per_s2[place] = each.stiffness_per_s2();
        arrays_.damping_per_s[place] = each.damping_per_s();
        arrays_.gain[place] = each.gain;
        arrays_.lead_s[place] = each.lead_s;
      }
    }
  }
}

void Bundle::keep_first() {
  const NozzleXY first = nozzle();
  *this = Bundle({models_.front()});
  set_nozzle(0, first);
}

double Bundle::step_s() const {
  constexpr double kLooksPerPeriod = 16.0;
  return std::min(models_.front().step_s,
                  2.0 * std::numbers::pi / (kLooksPerPeriod * fastest_rad_s_));
}

NozzleXY Bundle::nozzle(std::size_t number) const {
  NozzleXY nozzle;
  for (std::size_t mode = 0; mode < arrays_.modes; ++mode) {
    for (const std::size_t axis : {0U, 1U}) {
      const std::size_t place = arrays_.place(axis, mode) + number;
      (axis == 0 ? nozzle.x : nozzle.y).parts[mode] = {arrays_.states[place],
                                                       arrays_.states[arrays_.parts() + place]};
    }
  }
  return nozzle;
}

void Bundle::set_nozzle(std::size_t number, const NozzleXY& nozzle) {
  for (std::size_t mode = 0; mode < arrays_.modes; ++mode) {
    for (const std::size_t axis : {0U, 1U}) {
      const std::size_t place = arrays_.place(axis, mode) + number;
      const dynamics::NozzleMotion& part = (axis == 0 ? nozzle.x : nozzle.y).parts[mode];
      arrays_.states[place] = part.position;
      arrays_.states[arrays_.parts() + place] = part.velocity;
    }
  }
}

dynamics::NozzleMotionXY Bundle::motion(std::size_t number) const {
  const auto along = [&](std::size_t axis) {
    dynamics::NozzleMotion sum;
    for (std::size_t mode = 0; mode < arrays_.modes; ++mode) {
      const double* const position = arrays_.states.data() + arrays_.place(axis, mode) + number;
      sum.position += position[0];
      sum.velocity += position[arrays_.parts()];
    }
    return sum;
  };
  return {along(0), along(1)};
}

template <class Change>
void Bundle::change_all(const Change& change) {
  for (std::size_t number = 0; number < models_.size(); ++number) {
    NozzleXY state = nozzle(number);
    change(models_[number], state);
    set_nozzle(number, state);
  }
}

void Bundle::shift(double x_mm, double y_mm) {
  change_all([&](const NozzleModel& model, NozzleXY& nozzle) {
    nozzle.x.add(model.x.riding(x_mm));
    nozzle.y.add(model.y.riding(y_mm));
  });
}

void Bundle::settle(const dynamics::BaseSegment& x, const dynamics::BaseSegment& y,
                    double duration_s) {
  change_all([&](const NozzleModel& model, NozzleXY& nozzle) {
    nozzle.x = dynamics::exact_step(model.x, nozzle.x, x, duration_s);
    nozzle.y = dynamics::exact_step(model.y, nozzle.y, y, duration_s);
  });
}

bool Bundle::rest_on(const dynamics::BaseSegment& x, const dynamics::BaseSegment& y) const {
  const auto rests = [](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
                        const dynamics::BaseSegment& base) {
    const dynamics::FlexibleAxis::Gap gap =
        axis.gap(nozzle, axis.riding(base.position, base.velocity));
    return std::max(gap.place_mm, gap.speed_mm) < kRests_mm;
  };
  for (std::size_t number = 0; number < models_.size(); ++number) {
    const NozzleXY state = nozzle(number);
    if (!rests(models_[number].x, state.x, x) || !rests(models_[number].y, state.y, y)) {
      return false;
    }
  }
  return true;
}

void Bundle::ride_on(const dynamics::BaseSegment& x, const dynamics::BaseSegment& y) {
  change_all([&](const NozzleModel& model, NozzleXY& nozzle) {
    nozzle = {model.x.riding(x.position, x.velocity), model.y.riding(y.position, y.velocity)};
  });
}

void Bundle::begin_steps(double steps, double h) {
  // For fewer steps it does not pay to set up maps.
  constexpr double kManySteps = 6.0;
  // What an RK4 step may be of 1/ω: the swing is wrong by 2e-5 of itself then.
  constexpr double kLongest = 0.3;
  h_ = h;
  rk4_steps_ = std::max(static_cast<int>(std::ceil(fastest_rad_s_ * h / kLongest)), 1);
  has_maps_ = steps >= kManySteps;
  if (has_maps_) {
    kernel_->set_maps(h_, rk4_steps_, arrays_);
  }
}

void Bundle::step(const dynamics::BaseSegment& x, const dynamics::BaseSegment& y) {
  if (has_maps_) {
    kernel_->step_by_maps(x, y, arrays_);
  } else {
    kernel_->step(x, y, h_, rk4_steps_, arrays_);
  }
}

void Bundle::look(const ReferencePath& path, NearPath& near, double h) {
  kernel_->look(path, near, h > 0.0 ? last_h_ : 0.0, h, arrays_);
  last_h_ = h;
  nearest_ = static_cast<std::size_t>(arrays_.nearest[0]);
}

void Bundle::count(bool moves, bool lays) {
  if (moves) {
    add(arrays_.largest_mm2, last_h_, all_);
  }
  if (lays) {
    // A top may lie before the last look, when nothing was laid yet.
    if (!last_lays_) {
      for (std::size_t i = 0; i < arrays_.places; ++i) {
        arrays_.largest_mm2[i] = std::max(arrays_.before_mm2[i], arrays_.now_mm2[i]);
      }
    }
    add(arrays_.largest_mm2, last_h_, extruding_);
  }
  last_lays_ = lays;
}

void Bundle::count_moment(bool lays) {
  add(arrays_.now_mm2, 0.0, all_);
  if (lays) {
    add(arrays_.now_mm2, 0.0, extruding_);
  }
}

void Bundle::add(const std::vector<double>& largest_mm2, double h, BundleSums& sums) const {
  sums.weight_s += h;
  for (std::size_t i = 0; i < arrays_.places; ++i) {
    sums.contour2_mm2_s[i] += h * arrays_.mean_mm2[i];
    sums.contour2_max_mm2[i] = std::max(sums.contour2_max_mm2[i], largest_mm2[i]);
  }
}

DeviationStats Bundle::stats(const BundleSums& sums, std::size_t number) const {
  DeviationStats stats;
  if (sums.weight_s > 0.0) {
    stats.contour_max_mm = std::sqrt(sums.contour2_max_mm2[number]);
    stats.contour_rms_mm = std::sqrt(sums.contour2_mm2_s[number] / sums.weight_s);
    stats.duration_s = sums.weight_s;
  }
  return stats;
}

}  // namespace unflex::verify
