#include "unflex/study/machines.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "contour.hpp"
#include "tasks.hpp"
#include "unflex/verify/corners.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex_base.hpp"

namespace unflex::study {
namespace {

// The nozzle of a machine on a base: each of its modes hangs there by itself.
class TrueNozzle {
 public:
  // shift: share by which all frequencies are off.
  TrueNozzle(const std::vector<dynamics::Mode>& modes, double shift, const rivals::AxisPath& base,
             double start_s) {
    for (const dynamics::Mode& mode : modes) {
      parts_.push_back(
          {mode.gain,
           rivals::NozzleWalk(dynamics::FlexibleAxis(mode.omega_rad_s * (1.0 + shift), mode.zeta),
                              base, start_s)});
    }
  }

  [[nodiscard]] double at(double t) {
    double sum = 0.0;
    for (Part& part : parts_) {
      sum += part.gain * part.walk.at(t).position();
    }
    return sum;
  }

 private:
  struct Part {
    double gain;
    rivals::NozzleWalk walk;
  };
  std::vector<Part> parts_;
};

double reach_s(const Machine& machine) {
  double slowest = std::numeric_limits<double>::infinity();
  for_each_axis(
      [&](const MachineAxis& axis) {
        for (const dynamics::Mode& mode : axis.truth) {
          slowest = std::min(slowest, mode.omega_rad_s);
        }
      },
      machine.axes);
  return reach_of(slowest);
}

// How far the nozzle strays in one run.
struct RunStraying {
  std::vector<double> distances_mm;  // while filament is laid, at even times
  verify::CornerStats corners;
};

RunStraying straying_of(const Machine& machine, double shift, const BaseMotion& base,
                        const Run& run) {
  const double start_s = std::min(0.0, rivals::start_s(base));
  Axes<TrueNozzle> nozzle = map_axes(
      [&](const MachineAxis& axis, const rivals::AxisPath& path) {
        return TrueNozzle(axis.truth, shift, path, start_s);
      },
      machine.axes, base);
  ContourGauge gauge(run.plan, reach_s(machine));
  verify::CornerGauge corners(reach_s(machine));
  double end_s = 0.0;
  for (const planner::PlannedMove& move : run.plan) {
    corners.follow(move, end_s, end_s + move.duration_s());
    end_s += move.duration_s();
  }
  RunStraying result;
  for (int k = 0; k * kPrintStep_s <= end_s; ++k) {
    const double t = k * kPrintStep_s;
    XY at_mm;
    for_each_axis([&](double& own_mm, TrueNozzle& of) { own_mm = of.at(t); }, at_mm, nozzle);
    corners.sample(t, at_mm);
    const auto reading = gauge.measure(t, at_mm);
    if (reading.extruding) {
      result.distances_mm.push_back(reading.distance_mm);
    }
  }
  result.corners = corners.stats();
  return result;
}

std::optional<rivals::FittedShaper> shaper_of(Contender contender,
                                              const rivals::KlipperCalibration& calibration) {
  switch (contender) {
    case Contender::zv:
      return calibration.of(dynamics::ShaperKind::zv);
    case Contender::mzv:
      return calibration.of(dynamics::ShaperKind::mzv);
    case Contender::ei:
      return calibration.of(dynamics::ShaperKind::ei);
    case Contender::recommended:
      return calibration.recommended;
    case Contender::uncompensated:
    case Contender::unflex:
      break;
  }
  return std::nullopt;
}

rivals::AxisPath shaped(Contender contender, const rivals::KlipperCalibration& calibration,
                        rivals::AxisPath reference) {
  const auto shaper = shaper_of(contender, calibration);
  return shaper ? rivals::shaped(reference, shaper->pulses()) : std::move(reference);
}

std::string model_text(const std::vector<dynamics::Mode>& modes) {
  std::string text;
  for (const dynamics::Mode& mode : modes) {
    text += fmt::format("{}{:.1f} Hz ζ {:.3f}", text.empty() ? "" : " + ",
                        mode.omega_rad_s / (2.0 * std::numbers::pi), mode.zeta);
    text += modes.size() > 1 ? fmt::format(" gain {:.2f}", mode.gain) : std::string{};
  }
  return text;
}

std::string axis_text(const MachineAxis& axis, const compensate::AxisSetup& known) {
  const auto modes = known.axis.modes();
  return fmt::format(
      "known from {}: {}{}; machine by {}: {}; Klipper: {} {:.1f} Hz", axis.known_from,
      model_text({modes.begin(), modes.end()}),
      known.plants.empty() ? std::string{} : fmt::format(" and {} plants", known.plants.size()),
      axis.truth_from, model_text(axis.truth), dynamics::name(axis.shapers.recommended.kind),
      axis.shapers.recommended.freq_hz);
}

}  // namespace

struct MachineBench::Measured {
  // The errors that one contender leaves on the machine with one shift.
  struct Sums {
    verify::DeviationAccumulator distances;
    CornerSums corners;

    void add(const RunStraying& run) {
      for (const double distance_mm : run.distances_mm) {
        distances.add(distance_mm * distance_mm, 0.0, kPrintStep_s, 0);
      }
      corners.add(run.corners);
    }
  };
  std::array<std::array<Sums, kContenderCount>, kMachineShifts.size()> shifted;
  std::size_t failed_runs = 0;
};

std::string_view name(Contender contender) {
  constexpr std::array<std::string_view, kContenderCount> kNames = {
      "as sliced", "ZV", "MZV", "EI", "Klipper's choice", "unflex"};
  return kNames[static_cast<std::size_t>(contender)];
}

const ContenderResult& MachineResult::best_shaper(std::size_t shift) const {
  const AllContenders& contenders = shifted[shift];
  return *std::min_element(
      contenders.begin() + static_cast<std::ptrdiff_t>(Contender::zv),
      contenders.begin() + static_cast<std::ptrdiff_t>(Contender::unflex),
      [](const ContenderResult& a, const ContenderResult& b) { return a.rms_mm < b.rms_mm; });
}

double MachineResult::ratio(std::size_t shift) const {
  const double best_mm = best_shaper(shift).rms_mm;
  return best_mm > 0.0 ? of(Contender::unflex, shift).rms_mm / best_mm : 0.0;
}

MachineBench::MachineBench(Machine machine, const Options& options)
    : machine_(std::move(machine)), options_(options), measured_(std::make_unique<Measured>()) {}
MachineBench::~MachineBench() = default;
MachineBench::MachineBench(MachineBench&&) noexcept = default;

void MachineBench::add(const std::vector<Run>& runs) {
  const std::unique_ptr<compensate::Engine> engine = make_engine(options_);
  struct OfRun {
    std::array<std::array<RunStraying, kContenderCount>, kMachineShifts.size()> straying;
    bool failed = false;
  };
  std::vector<OfRun> results(runs.size());
  in_parallel(runs.size(), threads(options_), [&](std::size_t i) {
    const Run& run = runs[i];
    const auto references = rivals::on_axes_of(run.plan, rivals::reference_path);
    for (std::size_t c = 0; c < kContenderCount; ++c) {
      const auto contender = static_cast<Contender>(c);
      BaseMotion base{map_axes(
          [&](const MachineAxis& axis, const rivals::AxisPath& reference) {
            return shaped(contender, axis.shapers, reference);
          },
          machine_.axes, references)};
      if (contender == Contender::unflex) {
        Result<BaseMotion> solved = unflex_base(machine_.unflex, run.plan, kPrintParts, *engine);
        results[i].failed = !solved;
        if (solved) {
          base = std::move(*solved);
        }
      }
      for (std::size_t s = 0; s < kMachineShifts.size(); ++s) {
        results[i].straying[s][c] = straying_of(machine_, kMachineShifts[s], base, run);
      }
    }
  });
  for (const OfRun& of_run : results) {
    measured_->failed_runs += of_run.failed ? 1 : 0;
    for (std::size_t s = 0; s < kMachineShifts.size(); ++s) {
      for (std::size_t c = 0; c < kContenderCount; ++c) {
        measured_->shifted[s][c].add(of_run.straying[s][c]);
      }
    }
  }
}

MachineResult MachineBench::result() const {
  const Axes<std::string> texts = map_axes(axis_text, machine_.axes, machine_.unflex);
  MachineResult result{
      machine_.name, fmt::format("X {}\nY {}", texts.x, texts.y), {}, 0, measured_->failed_runs};
  for (std::size_t s = 0; s < kMachineShifts.size(); ++s) {
    for (std::size_t c = 0; c < kContenderCount; ++c) {
      const Measured::Sums& sums = measured_->shifted[s][c];
      const verify::DeviationStats of = sums.distances.stats();
      result.corners = sums.corners.count;
      result.shifted[s][c] = {of.contour_rms_mm, of.contour_p99_mm, of.contour_max_mm,
                              sums.corners.rms_mm(), sums.corners.max_mm};
    }
  }
  return result;
}

}  // namespace unflex::study
