#include "unflex/study/map_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "contour.hpp"
#include "tasks.hpp"
#include "unflex/dynamics/shaped.hpp"
#include "unflex/dynamics/shapers.hpp"
#include "unflex/planner/plan_times.hpp"
#include "unflex_base.hpp"

namespace unflex::study {
namespace {

using dynamics::ShaperKind;

constexpr std::array<ShaperKind, 4> kKinds = {ShaperKind::zv, ShaperKind::mzv, ShaperKind::zvd,
                                              ShaperKind::ei};
// Frequencies that each kind is tried at, from a little below the lowest of all places to above the
// highest: a shaper that is too short may still do better, as it rounds corners less.
constexpr std::size_t kTunings = 15;
constexpr double kLowest = 0.9;
constexpr double kHighest = 1.4;
// Beside the shapers: as sliced, and unflex.
constexpr std::size_t kOthers = 2;

Axes<double> hz_of(const MapPlace& place) {
  return map_axes([](const compensate::AxisSetup& axis) { return axis.axis.main_hz(); },
                  place.unflex);
}

// The nozzle's response to a base, at even times from the base's begin on.
class Response {
 public:
  Response(const dynamics::FlexibleAxis& axis, const rivals::AxisPath& base, double from_s,
           double to_s)
      : from_s_(from_s) {
    rivals::NozzleWalk walk(axis, base, from_s);
    for (double t = from_s; t <= to_s; t += kPrintStep_s) {
      places_mm_.push_back(walk.at(t).position());
    }
  }
  // At rest before the first time, and where it is at the last time after that.
  [[nodiscard]] double at(double t) const {
    const double steps =
        std::clamp((t - from_s_) / kPrintStep_s, 0.0, static_cast<double>(places_mm_.size() - 1));
    const auto k = std::min(static_cast<std::size_t>(steps), places_mm_.size() - 2);
    return std::lerp(places_mm_[k], places_mm_[k + 1], steps - static_cast<double>(k));
  }

 private:
  double from_s_;
  std::vector<double> places_mm_;
};

struct Sum {
  double square_mm2 = 0.0;
  std::size_t samples = 0;

  void add(const Sum& other) {
    square_mm2 += other.square_mm2;
    samples += other.samples;
  }
  [[nodiscard]] double rms_mm() const {
    return samples > 0 ? std::sqrt(square_mm2 / static_cast<double>(samples)) : 0.0;
  }
};

// How far a nozzle strays whose place at a time is at(t).
template <class At>
Sum straying(const Run& run, double reach_s, const At& at) {
  ContourGauge gauge(run.plan, reach_s);
  const double end_s = planner::duration_s(run.plan);
  Sum sum;
  for (int k = 0; k * kPrintStep_s <= end_s; ++k) {
    const double t = k * kPrintStep_s;
    const auto reading = gauge.measure(t, at(t));
    if (reading.extruding) {
      sum.square_mm2 += reading.distance_mm * reading.distance_mm;
      ++sum.samples;
    }
  }
  return sum;
}

// The lowest and the highest frequency of an axis.
struct Span {
  double low_hz = std::numeric_limits<double>::infinity();
  double high_hz = 0.0;

  [[nodiscard]] double at(std::size_t tuning) const {
    return std::lerp(kLowest * low_hz, kHighest * high_hz,
                     static_cast<double>(tuning) / static_cast<double>(kTunings - 1));
  }
};

Axes<Span> span_of(const std::vector<MapPlace>& places) {
  Axes<Span> spans;
  for (const MapPlace& place : places) {
    for_each_axis(
        [](Span& span, double hz) {
          span.low_hz = std::min(span.low_hz, hz);
          span.high_hz = std::max(span.high_hz, hz);
        },
        spans, hz_of(place));
  }
  return spans;
}

}  // namespace

struct MapBench::Measured {
  // By place: as sliced, each kind at each tuning, unflex.
  std::vector<std::vector<Sum>> sums;
  Axes<Span> spans;
  // Pulses of each kind at each tuning.
  std::vector<Axes<dynamics::ShaperPulses>> pulses;
  double seconds = 0.0;
  std::size_t failed_runs = 0;
};

double MapContender::worst_mm() const { return std::ranges::max(rms_mm); }

const MapContender& MapOutcome::best_shaper() const {
  return *std::min_element(
      contenders.begin() + 1, contenders.end() - 1,
      [](const MapContender& a, const MapContender& b) { return a.worst_mm() < b.worst_mm(); });
}

MapBench::MapBench(std::vector<MapPlace> places, const Options& options)
    : places_(std::move(places)), options_(options), measured_(std::make_unique<Measured>()) {
  measured_->spans = span_of(places_);
  for (const ShaperKind kind : kKinds) {
    for (std::size_t tuning = 0; tuning < kTunings; ++tuning) {
      measured_->pulses.push_back(map_axes(
          [&](const Span& span, const compensate::AxisSetup& axis) {
            const double damping =
                std::min(axis.axis.main_damping_ratio(), dynamics::max_damping_ratio(kind));
            return dynamics::shaper_pulses(kind, span.at(tuning), damping).value();
          },
          measured_->spans, places_.front().unflex));
    }
  }
  measured_->sums.assign(places_.size(), std::vector<Sum>(measured_->pulses.size() + kOthers));
}
MapBench::~MapBench() = default;
MapBench::MapBench(MapBench&&) noexcept = default;

void MapBench::add(const std::vector<Run>& runs) {
  std::vector<const Run*> taken;
  for (const Run& run : runs) {
    if (measured_->seconds < kMapPrint_s) {
      measured_->seconds += planner::duration_s(run.plan);
      taken.push_back(&run);
    }
  }
  const std::unique_ptr<compensate::Engine> engine = make_engine(options_);
  struct Task {
    std::vector<Sum> sums;
    bool failed = false;
  };
  std::vector<Task> tasks(taken.size() * places_.size());
  in_parallel(tasks.size(), threads(options_), [&](std::size_t i) {
    const Run& run = *taken[i / places_.size()];
    const MapPlace& place = places_[i % places_.size()];
    Task& task = tasks[i];
    const double reach_s = reach_of(least_of_axes(
        [](const compensate::AxisSetup& axis) { return axis.axis.slowest_rad_s(); }, place.unflex));
    const auto references = rivals::on_axes_of(run.plan, rivals::reference_path);
    const double end_s = planner::duration_s(run.plan);
    const auto responses_to = [&](const Axes<rivals::AxisPath>& base) {
      const double start_s = std::min(0.0, rivals::start_s(base));
      return map_axes(
          [&](const compensate::AxisSetup& axis, const rivals::AxisPath& path) {
            // Pulses before their axis' time need what comes after.
            constexpr double kPulses_s = 0.2;
            return Response(axis.axis, path, start_s, end_s + kPulses_s);
          },
          place.unflex, base);
    };
    const Axes<Response> sliced = responses_to(references);
    const auto take = [&](const auto& at) { task.sums.push_back(straying(run, reach_s, at)); };
    take([&](double t) {
      return map_axes([&](const Response& response) { return response.at(t); }, sliced);
    });
    for (const Axes<dynamics::ShaperPulses>& pulses : measured_->pulses) {
      take([&](double t) {
        return map_axes(
            [&](const dynamics::ShaperPulses& of_axis, const Response& response) {
              double sum = 0.0;
              for (const dynamics::Pulse& pulse : of_axis) {
                sum += pulse.weight * response.at(t - pulse.time_s);
              }
              return sum;
            },
            pulses, sliced);
      });
    }
    const Result<BaseMotion> solved = unflex_base(place.unflex, run.plan, kPrintParts, *engine);
    task.failed = !solved;
    const Axes<Response> compensated = solved ? responses_to(*solved) : sliced;
    take([&](double t) {
      return map_axes([&](const Response& response) { return response.at(t); }, compensated);
    });
  });
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    measured_->failed_runs += tasks[i].failed ? 1 : 0;
    std::vector<Sum>& sums = measured_->sums[i % places_.size()];
    for (std::size_t c = 0; c < sums.size(); ++c) {
      sums[c].add(tasks[i].sums[c]);
    }
  }
}

MapOutcome MapBench::outcome() const {
  MapOutcome outcome;
  outcome.measured_s = measured_->seconds;
  outcome.failed_runs = measured_->failed_runs;
  for (const MapPlace& place : places_) {
    outcome.places_mm.push_back(place.place_mm);
    outcome.freq_hz.push_back(hz_of(place));
  }
  const auto contender = [&](std::string name, std::size_t which) {
    MapContender made{std::move(name)};
    for (const std::vector<Sum>& sums : measured_->sums) {
      made.rms_mm.push_back(sums[which].rms_mm());
    }
    return made;
  };
  outcome.contenders.push_back(contender("as sliced", 0));
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind) {
    std::optional<MapContender> best;
    for (std::size_t tuning = 0; tuning < kTunings; ++tuning) {
      MapContender tried =
          contender(std::string(dynamics::name(kKinds[kind])), 1 + kind * kTunings + tuning);
      tried.freq_hz = map_axes([&](const Span& span) { return span.at(tuning); }, measured_->spans);
      if (!best || tried.worst_mm() < best->worst_mm()) {
        best = std::move(tried);
      }
    }
    outcome.contenders.push_back(std::move(*best));
  }
  outcome.contenders.push_back(contender("unflex", measured_->pulses.size() + 1));
  return outcome;
}

}  // namespace unflex::study
