#include "bundle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "bundle_kernels.hpp"
#include "shaped_base.hpp"

namespace unflex::verify {
namespace {

// A state closer to even motion than this counts as even motion.
constexpr double kRests_mm = 1e-7;
// Numbers of a swing: place and rate of each mode.
constexpr std::size_t kSwing = 2 * dynamics::ModeFrame::kCount;

NozzleXY riding_on(const NozzleModel& model, const dynamics::BaseXY& base) {
  return riding(model, dynamics::place_mm(base), dynamics::velocity_mm_s(base));
}

}  // namespace

const BundleKernel& bundle_kernel() {
  return has_four_lanes() ? four_lanes_bundle() : two_lanes_bundle();
}

Bundle::Bundle(std::vector<NozzleModel> models)
    : given_(std::move(models)), models_(given_), kernel_(&bundle_kernel()) {
  arrays_.places = (models_.size() + kLanes - 1) / kLanes * kLanes;
  make_room();
  for (std::vector<double>* of_nozzles :
       {&arrays_.nearest, &arrays_.now_mm2, &arrays_.before_mm2, &arrays_.mean_mm2,
        &arrays_.largest_mm2, &all_.contour2_mm2_s, &all_.contour2_max_mm2,
        &extruding_.contour2_mm2_s, &extruding_.contour2_max_mm2}) {
    of_nozzles->assign(arrays_.places, 0.0);
  }
  arrays_.away.fill(std::vector<double>(arrays_.places));
  arrays_.was.fill(std::vector<double>(arrays_.places));
  take_models();
}

// Finds the largest number of modes, and has all that lies there by modes be 0.
void Bundle::make_room() {
  arrays_.modes = 0;
  fastest_rad_s_ = 0.0;
  for (const NozzleModel& model : models_) {
    for_each_axis(
        [&](const dynamics::FlexibleAxis& axis) {
          arrays_.modes = has_frames() ? 1 : std::max(arrays_.modes, axis.mode_count());
          fastest_rad_s_ = std::max(fastest_rad_s_, axis.fastest_rad_s());
        },
        model);
  }
  const std::size_t parts = arrays_.parts();
  for (std::vector<double>* of_modes :
       {&arrays_.stiffness_per_s2, &arrays_.damping_per_s, &arrays_.gain, &arrays_.lead_s}) {
    of_modes->assign(parts, 0.0);
  }
  arrays_.states.assign(2 * parts + (has_frames() ? kSwing * models_.size() : 0), 0.0);
  for (std::vector<double>& map : arrays_.maps) {
    map.assign(2 * parts, 0.0);
  }
}

void Bundle::take_models() {
  if (has_frames()) {
    return;
  }
  for (std::size_t number = 0; number < models_.size(); ++number) {
    for (const std::size_t axis : {0U, 1U}) {
      const dynamics::FlexibleAxis& of = models_[number][axis];
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

void Bundle::set_frequencies(const Axes<double>& shares) {
  constexpr double kSame = 1e-4;
  const auto is_same = [](double share, double present) {
    return std::abs(share - present) < kSame * present;
  };
  if (all_axes(is_same, shares, shares_)) {
    return;
  }
  shares_ = shares;
  models_ = given_;
  fastest_rad_s_ = 0.0;
  for (NozzleModel& model : models_) {
    for_each_axis(
        [&](dynamics::FlexibleAxis& axis, double share) {
          axis = axis.detuned(share);
          fastest_rad_s_ = std::max(fastest_rad_s_, axis.fastest_rad_s());
        },
        model, shares);
    if (model.frame) {
      model.frame = model.frame->detuned(shares.x);
    }
  }
  take_models();
  has_maps_ = false;
}

void Bundle::set_models(const std::vector<NozzleModel>& models, const XY& base_mm) {
  given_.assign(models.begin(), models.begin() + static_cast<std::ptrdiff_t>(count()));
  models_ = given_;
  shares_ = on_all_axes(1.0);
  make_room();
  take_models();
  has_maps_ = false;
  ride_on(map_axes(
      [](double place_mm) {
        return dynamics::BaseSegment{place_mm, 0.0, 0.0};
      },
      base_mm));
}

void Bundle::keep_first() {
  const NozzleXY first = nozzle();
  const XY place_mm = dynamics::place_mm(motion(0));
  const Axes<double> shares = shares_;
  *this = Bundle({given_.front()});
  set_frequencies(shares);
  set_nozzle(0, first);
  if (has_frames()) {
    shift(place_mm - dynamics::place_mm(motion(0)));
  }
}

double Bundle::step_s() const {
  constexpr double kLooksPerPeriod = 16.0;
  return std::min(models_.front().step_s,
                  2.0 * std::numbers::pi / (kLooksPerPeriod * fastest_rad_s_));
}

NozzleXY Bundle::nozzle(std::size_t number) const {
  if (has_frames()) {
    return swing(number);
  }
  NozzleXY nozzle;
  for (std::size_t mode = 0; mode < arrays_.modes; ++mode) {
    for (const std::size_t axis : {0U, 1U}) {
      const std::size_t place = arrays_.place(axis, mode) + number;
      nozzle[axis].parts[mode] = {arrays_.states[place], arrays_.states[arrays_.parts() + place]};
    }
  }
  return nozzle;
}

void Bundle::set_nozzle(std::size_t number, const NozzleXY& nozzle, const XY& base_mm) {
  if (has_frames()) {
    set_swing(number, nozzle, resting_at(base_mm));
    return;
  }
  for (std::size_t mode = 0; mode < arrays_.modes; ++mode) {
    for (const std::size_t axis : {0U, 1U}) {
      const std::size_t place = arrays_.place(axis, mode) + number;
      const dynamics::NozzleMotion& part = nozzle[axis].parts[mode];
      arrays_.states[place] = part.position;
      arrays_.states[arrays_.parts() + place] = part.velocity;
    }
  }
}

NozzleXY Bundle::swing(std::size_t number) const {
  const double* const from = arrays_.states.data() + 2 * arrays_.parts() + kSwing * number;
  NozzleXY result;
  for (std::size_t mode = 0; mode < dynamics::ModeFrame::kCount; ++mode) {
    result.x.parts[mode] = {from[2 * mode], from[2 * mode + 1]};
  }
  return result;
}

void Bundle::set_swing(std::size_t number, const NozzleXY& swing, const dynamics::BaseXY& base) {
  double* const to = arrays_.states.data() + 2 * arrays_.parts() + kSwing * number;
  for (std::size_t mode = 0; mode < dynamics::ModeFrame::kCount; ++mode) {
    to[2 * mode] = swing.x.parts[mode].position;
    to[2 * mode + 1] = swing.x.parts[mode].velocity;
  }
  const auto ahead = models_[number].frame->ahead(swing);
  for (const std::size_t axis : {0U, 1U}) {
    const std::size_t place = arrays_.place(axis, 0) + number;
    arrays_.states[place] = base[axis].position + ahead[axis].position;
    arrays_.states[arrays_.parts() + place] = ahead[axis].velocity;
  }
}

// ẏ = u̇ − β̇ and ü = −2ζω ẏ − ω² y, where β̈ is constant.
void Bundle::step_swings(const dynamics::BaseXY& base, const dynamics::BaseSegment& z, double h,
                         int rk4_steps) {
  const double dt = h / rk4_steps;
  dynamics::BaseXY end = base;
  for_each_axis(
      [&](dynamics::BaseSegment& axis) {
        axis.position += h * (axis.velocity + 0.5 * axis.acceleration * h);
        axis.velocity += h * axis.acceleration;
      },
      end);
  for (std::size_t number = 0; number < models_.size(); ++number) {
    const dynamics::ModeFrame& frame = *models_[number].frame;
    const auto velocity = frame.to_modes({base.x.velocity, base.y.velocity, z.velocity});
    const auto accel = frame.to_modes({base.x.acceleration, base.y.acceleration, z.acceleration});
    NozzleXY of_nozzle = swing(number);
    for (std::size_t i = 0; i < accel.size(); ++i) {
      if (!frame.mode(i)) {
        continue;
      }
      const double stiffness = frame.mode(i)->stiffness_per_s2();
      const double damping = frame.mode(i)->damping_per_s();
      auto& [y, v] = of_nozzle.x.parts[i];
      for (int step = 0; step < rk4_steps; ++step) {
        const double base_v = velocity[i] + step * dt * accel[i];
        const auto slope = [&](double t, double of_v) { return of_v - (base_v + t * accel[i]); };
        const auto rate = [&](double of_y, double of_slope) {
          return -damping * of_slope - stiffness * of_y;
        };
        const double s1 = slope(0.0, v);
        const double a1 = rate(y, s1);
        const double s2 = slope(0.5 * dt, v + 0.5 * dt * a1);
        const double a2 = rate(y + 0.5 * dt * s1, s2);
        const double s3 = slope(0.5 * dt, v + 0.5 * dt * a2);
        const double a3 = rate(y + 0.5 * dt * s2, s3);
        const double s4 = slope(dt, v + dt * a3);
        const double a4 = rate(y + dt * s3, s4);
        y += dt / 6.0 * (s1 + 2.0 * s2 + 2.0 * s3 + s4);
        v += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      }
    }
    set_swing(number, of_nozzle, end);
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

template <class Change, class Value>
void Bundle::change_all(const Change& change, const Axes<Value>& by) {
  for (std::size_t number = 0; number < models_.size(); ++number) {
    NozzleXY state = nozzle(number);
    for_each_axis(change, models_[number], by, state);
    set_nozzle(number, state);
  }
}

void Bundle::shift(const XY& by_mm) {
  if (has_frames()) {
    for (std::size_t number = 0; number < models_.size(); ++number) {
      arrays_.states[arrays_.place(0, 0) + number] += by_mm.x;
      arrays_.states[arrays_.place(1, 0) + number] += by_mm.y;
    }
    return;
  }
  change_all([&](const dynamics::FlexibleAxis& axis, double by,
                 dynamics::NozzleState& nozzle) { nozzle.add(axis.riding(by)); },
             by_mm);
}

void Bundle::settle(const dynamics::BaseXY& base, double duration_s) {
  if (has_frames()) {
    step_swings(base, {}, duration_s, rk4_steps_of(duration_s));
    return;
  }
  change_all(
      [&](const dynamics::FlexibleAxis& axis, const dynamics::BaseSegment& of_axis,
          dynamics::NozzleState& nozzle) {
        nozzle = dynamics::exact_step(axis, nozzle, of_axis, duration_s);
      },
      base);
}

bool Bundle::rest_on(const dynamics::BaseXY& base) const {
  const auto rests = [](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
                        const dynamics::BaseSegment& of_axis) {
    const dynamics::FlexibleAxis::Gap gap =
        axis.gap(nozzle, axis.riding(of_axis.position, of_axis.velocity));
    return std::max(gap.place_mm, gap.speed_mm) < kRests_mm;
  };
  for (std::size_t number = 0; number < models_.size(); ++number) {
    const NozzleModel& model = models_[number];
    if (model.frame ? model.frame->apart_mm(swing(number), riding_on(model, base)) >= kRests_mm
                    : !all_axes(rests, model, nozzle(number), base)) {
      return false;
    }
  }
  return true;
}

void Bundle::ride_on(const dynamics::BaseXY& base) {
  if (has_frames()) {
    for (std::size_t number = 0; number < models_.size(); ++number) {
      set_swing(number, riding_on(models_[number], base), base);
    }
    return;
  }
  change_all(
      [](const dynamics::FlexibleAxis& axis, const dynamics::BaseSegment& of_axis,
         dynamics::NozzleState& nozzle) {
        nozzle = axis.riding(of_axis.position, of_axis.velocity);
      },
      base);
}

void Bundle::begin_steps(double steps, double h) {
  // For fewer steps it does not pay to set up maps.
  constexpr double kManySteps = 6.0;
  h_ = h;
  rk4_steps_ = rk4_steps_of(h);
  has_maps_ = steps >= kManySteps && !has_frames();
  if (has_maps_) {
    kernel_->set_maps(h_, rk4_steps_, arrays_);
  }
}

int Bundle::rk4_steps_of(double h) const {
  // The longest RK4 step as a share of 1/ω. The swing is then wrong by 2e-5 of itself.
  constexpr double kLongest = 0.3;
  return std::max(static_cast<int>(std::ceil(fastest_rad_s_ * h / kLongest)), 1);
}

double Bundle::above_mm(std::size_t number) const {
  return has_frames() ? models_[number].frame->ahead(swing(number))[2].position : 0.0;
}

void Bundle::step(const dynamics::BaseXY& base, const dynamics::BaseSegment& z) {
  if (has_frames()) {
    step_swings(base, z, h_, rk4_steps_);
  } else if (has_maps_) {
    kernel_->step_by_maps(base, arrays_);
  } else {
    kernel_->step(base, h_, rk4_steps_, arrays_);
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
