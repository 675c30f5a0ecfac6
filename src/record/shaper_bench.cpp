#include "shaper_bench.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/dynamics/shapers.hpp"

namespace unflex::record {
namespace {

// Moments per period of the faster axis.
constexpr double kPerPeriod = 16.0;
constexpr double kBlock_s = 1.0;
// After this much measured time every second block is left out. After the same time again every
// second one of the rest is left out, and so on.
constexpr double kStrideLasts_s = 60.0;
// How many moments are skipped before the nozzles are asked once, so that they forget the past.
constexpr std::size_t kSkipped = 128;
// A nozzle without a new state for kGap intervals has stood still or moved steadily. If it moved
// steadily, it is within kSteady_mm of where its velocity has led it.
constexpr double kGap = 4.0;
constexpr double kSteady_mm = 1e-4;
// At a corner the deviation peaks in a kink. So if its square exceeds kNearPeak times the largest
// so far, it is measured kFine times in the interval.
constexpr double kNearPeak = 0.16;
constexpr int kFine = 8;
// Lag, in intervals, between the newest nozzle state and the moment that is measured.
constexpr double kMargin = 2.0;

// The shapers that printers use most. The others would crowd the figure.
bool is_drawn(dynamics::ShaperKind kind) {
  return kind == dynamics::ShaperKind::zv || kind == dynamics::ShaperKind::mzv ||
         kind == dynamics::ShaperKind::ei;
}

bool is_steady(const dynamics::NozzleMotion& from, const dynamics::NozzleMotion& to,
               double duration_s) {
  const double way_mm = to.position - from.position;
  return std::abs(way_mm - duration_s * from.velocity) < kSteady_mm &&
         std::abs(way_mm - duration_s * to.velocity) < kSteady_mm;
}

double mean_delay_s(const dynamics::ShaperPulses& pulses) {
  double delay_s = 0.0;
  for (const dynamics::Pulse& pulse : pulses) {
    delay_s += pulse.weight * pulse.time_s;
  }
  return delay_s;
}

dynamics::ShaperPulses earlier(const dynamics::ShaperPulses& pulses, double shift_s) {
  dynamics::ShaperPulses result = pulses.empty() ? dynamics::ShaperPulses{{0.0, 1.0}} : pulses;
  for (dynamics::Pulse& pulse : result) {
    pulse.time_s -= shift_s;
  }
  return result;
}

// Some firmwares delay the whole motion. The part of the delay that both axes share only makes the
// print late. It is taken away, because the bench looks for the nozzle near where the plan is.
PrinterShaper without_common_delay(const PrinterShaper& shaper) {
  const double shift_s = 0.5 * sum_of_axes(mean_delay_s, shaper.pulses);
  return {shaper.name,
          map_axes([&](const auto& of_axis) { return earlier(of_axis, shift_s); }, shaper.pulses)};
}

}  // namespace

ShaperBench::ShaperBench(const verify::NozzleModel& model,
                         std::span<const dynamics::ShaperKind> kinds,
                         const std::optional<PrinterShaper>& printer_shaper, std::size_t machines)
    : interval_s_(std::clamp(
          1.0 / (kPerPeriod *
                 most_of_axes([](const dynamics::FlexibleAxis& axis) { return axis.main_hz(); },
                              model)),
          5e-4, 2e-3)),
      last_add_s_(machines, -1.0),
      last_(machines),
      near_(verify::reach_s(model)) {
  for (const dynamics::ShaperKind kind : kinds) {
    Shaper shaper{std::string(dynamics::name(kind)),
                  is_drawn(kind),
                  {},
                  verify::CornerGauge(verify::reach_s(model))};
    const auto pulses = map_axes(
        [&](const dynamics::FlexibleAxis& axis) {
          return dynamics::shaper_pulses(kind, axis.main_hz(), axis.main_damping_ratio());
        },
        model);
    if (all_axes([](const auto& of_axis) { return of_axis.has_value(); }, pulses)) {
      install(shaper, map_axes([](const auto& of_axis) { return *of_axis; }, pulses), machines);
    }
    shapers_.push_back(std::move(shaper));
  }
  if (printer_shaper) {
    const PrinterShaper own = without_common_delay(*printer_shaper);
    Shaper shaper{own.name, true, {}, verify::CornerGauge(verify::reach_s(model))};
    shaper.printers_own = true;
    install(shaper, own.pulses, machines);
    shapers_.push_back(std::move(shaper));
  }
}

void ShaperBench::install(Shaper& shaper, const Axes<dynamics::ShaperPulses>& pulses,
                          std::size_t machines) {
  shaper.nozzles.assign(machines, Nozzle{rivals::ShapedNozzle(pulses)});
  lookahead_s_ = std::max(lookahead_s_, shaper.nozzles.front().shaped.lookahead_s());
}

void ShaperBench::add(std::size_t machine, double time_s,
                      const dynamics::NozzleMotionXY& unshaped) {
  const double last_s = last_add_s_[machine];
  if (time_s - last_s < interval_s_) {
    return;
  }
  const auto add = [&](double at_s, const dynamics::NozzleMotionXY& nozzle) {
    for (Shaper& shaper : shapers_) {
      if (!shaper.nozzles.empty()) {
        shaper.nozzles[machine].shaped.add(at_s, nozzle);
      }
    }
  };
  const dynamics::NozzleMotionXY& last = last_[machine];
  const auto was_steady = [&](const dynamics::NozzleMotion& from,
                              const dynamics::NozzleMotion& to) {
    return is_steady(from, to, time_s - last_s);
  };
  if (last_s >= 0.0 && time_s - last_s > kGap * interval_s_ &&
      !all_axes(was_steady, last, unshaped)) {
    // Two states at rest, so that no cubic spans the whole rest.
    const auto at_rest = [](const dynamics::NozzleMotion& nozzle) {
      return dynamics::NozzleMotion{nozzle.position, 0.0};
    };
    add(last_s + interval_s_, map_axes(at_rest, last));
    add(time_s - interval_s_, map_axes(at_rest, unshaped));
  }
  add(time_s, unshaped);
  last_add_s_[machine] = time_s;
  last_[machine] = unshaped;
}

double ShaperBench::memory_s() const {
  return is_empty() ? 0.0 : lookahead_s_ + 2.0 * kMargin * interval_s_;
}

bool ShaperBench::is_sampled(double time_s) const {
  return static_cast<std::size_t>(time_s / kBlock_s) % stride_ == 0;
}

void ShaperBench::advance(const verify::ReferencePath& path, double time_s) {
  if (is_empty()) {
    return;
  }
  if (!begun_) {
    begun_ = true;
    near_.begin(path);
  }
  piece_ = std::max(piece_, path.first());
  for (followed_ = std::max(followed_, path.first()); followed_ < path.end(); ++followed_) {
    for (Shaper& shaper : shapers_) {
      shaper.corners.follow(path[followed_].move, path[followed_].start_s, path[followed_].end_s);
    }
  }
  for (const double until_s = time_s - lookahead_s_ - kMargin * interval_s_; next_s_ <= until_s;
       next_s_ += interval_s_) {
    while (piece_ < path.end() && path[piece_].end_s <= next_s_) {
      ++piece_;
    }
    if (piece_ == path.end()) {
      return;
    }
    const verify::PathPiece& piece = path[piece_];
    // Skip whole intervals, so that the moments do not depend on how the path is handed over.
    if (piece.start_s > next_s_ + interval_s_) {
      const double rest_s = std::min(piece.start_s, until_s) - next_s_;
      next_s_ += interval_s_ * std::max(0.0, std::ceil(rest_s / interval_s_) - 1.0);
      continue;
    }
    const bool sampled = is_sampled(next_s_);
    const bool counts = piece.extruding && piece.start_s <= next_s_ && sampled;
    if (!sampled) {
      for (Shaper& shaper : shapers_) {
        shaper.corners.miss(next_s_);
      }
    }
    if (counts || ++skipped_ % kSkipped == 0) {
      measure(path, counts);
    }
  }
}

void ShaperBench::measure(const verify::ReferencePath& path, bool counts) {
  if (counts) {
    near_.slide(path, next_s_);
  }
  const double weight = static_cast<double>(stride_) * interval_s_;
  peaking_.clear();
  const auto squared_error = [&](const dynamics::NozzleMotionXY& state) {
    std::size_t nearest = 0;
    return near_.squared_contour_error(path, dynamics::place_mm(state), nearest);
  };
  for (Shaper& shaper : shapers_) {
    for (Nozzle& nozzle : shaper.nozzles) {
      // Asked in any case, so that the nozzle forgets what is past.
      const dynamics::NozzleMotionXY state = nozzle.shaped.at(next_s_);
      if (!counts) {
        continue;
      }
      if (&nozzle == shaper.nozzles.data()) {
        look_at_corners(shaper, state);
      }
      const double contour2 = squared_error(state);
      nozzle.sum_contour2 += weight * contour2;
      if (contour2 > kNearPeak * nozzle.contour2_max_mm2) {
        peaking_.push_back(&nozzle);
      }
    }
    if (!counts) {
      shaper.corners.lift();
    }
  }
  if (!counts) {
    return;
  }
  for (int fine = 0; fine < kFine && !peaking_.empty(); ++fine) {
    const double time_s = next_s_ + interval_s_ * fine / kFine;
    near_.slide(path, time_s);
    for (Nozzle* const nozzle : peaking_) {
      nozzle->contour2_max_mm2 =
          std::max(nozzle->contour2_max_mm2, squared_error(nozzle->shaped.at(time_s)));
    }
  }
  weight_s_ += weight;
  measured_s_ += interval_s_;
  at_stride_s_ += interval_s_;
  if (at_stride_s_ >= kStrideLasts_s) {
    stride_ *= 2;
    at_stride_s_ = 0.0;
  }
}

void ShaperBench::look_at_corners(Shaper& shaper, const dynamics::NozzleMotionXY& state) const {
  const double h = next_s_ - shaper.last_s;
  // Between two moments a nozzle that rounds a corner does not go straight.
  const int parts = h < 1.5 * interval_s_ && shaper.corners.is_near(next_s_) ? kFine : 1;
  for (int part = 1; part < parts; ++part) {
    const double u = static_cast<double>(part) / kFine;
    const dynamics::NozzleMotionXY between =
        map_axes([&](const dynamics::NozzleMotion& a,
                     const dynamics::NozzleMotion& b) { return rivals::on_cubic(a, b, h, u); },
                 shaper.last, state);
    shaper.corners.sample(shaper.last_s + u * h, dynamics::place_mm(between));
  }
  shaper.corners.sample(next_s_, dynamics::place_mm(state));
  shaper.last_s = next_s_;
  shaper.last = state;
}

std::vector<report::Contender> ShaperBench::contenders() const {
  std::vector<report::Contender> result;
  for (const Shaper& shaper : shapers_) {
    report::Contender contender{shaper.name, {}, shaper.drawn, std::nullopt, shaper.printers_own};
    const verify::CornerStats corners = shaper.corners.stats();
    if (corners.count > 0) {
      contender.corner_rms_mm = corners.rms_mm;
    }
    for (const Nozzle& nozzle : shaper.nozzles) {
      contender.spreads.push_back(
          {std::sqrt(nozzle.contour2_max_mm2),
           weight_s_ > 0.0 ? std::sqrt(nozzle.sum_contour2 / weight_s_) : 0.0});
    }
    result.push_back(std::move(contender));
  }
  return result;
}

}  // namespace unflex::record
