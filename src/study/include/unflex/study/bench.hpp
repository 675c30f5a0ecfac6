// A bench that compares methods on one planned motion. Each method moves the base in its own way.
// One nozzle model hangs on every base, and one gauge measures how far the nozzle strays.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/compensate/run.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/core/problem_size.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/rivals/axis_path.hpp"
#include "unflex/verify/corners.hpp"

namespace unflex::study {

enum class Method {
  uncompensated,
  zv,
  mzv,
  zvd,
  ei,
  two_hump_ei,
  three_hump_ei,
  mzv_4_pulses,
  mzv_5_pulses,
  mzv_6_pulses,
  s_curve,
  slow_s_curve,
  filtered_spline,
  thesis_least_squares,
  thesis_velocity_defects,
  unflex_2x,
  unflex_4x,
  unflex_10x,
  unflex_band_4x,  // for frequencies that may be off by kBandError
  // unflex 4× without its second stage; tried only where there is one.
  first_stage_4x,
};
inline constexpr std::size_t kMethodCount = 19;  // without first_stage_4x

// "uncompensated", "ZV", "unflex 4×" …
[[nodiscard]] std::string_view name(Method method);

// Relative errors of the true natural frequency against the one that the base was made for.
inline constexpr std::array<double, 5> kFrequencyErrors = {0.0, -0.10, -0.05, 0.05, 0.10};

// By which share of itself the frequency may be off for unflex_band_4x, either way.
inline constexpr double kBandError = 0.1;

// BenchSetup::step_s and parts for prints, which are long.
inline constexpr double kPrintStep_s = 2e-4;
inline constexpr int kPrintParts = 5;

// The axes that hang on the base.
using Nozzle = Axes<dynamics::FlexibleAxis>;

struct BenchSetup {
  // The acceleration limits of `unflex` and `unflex_band` are set per method.
  compensate::Setup unflex;
  compensate::Setup unflex_band;    // of unflex_band_4x
  std::optional<Nozzle> two_stage;  // the axes with what rings behind them, if anything does
  // The methods of unflex allow multiples of this acceleration. thesis_least_squares derives its
  // limit of jerk from it.
  double plan_accel_mm_s2 = 5000.0;
  double thesis_period_s = 5e-3;
  int parts = 10;             // parabolas per node interval of unflex' base
  double step_s = 5e-5;       // between the samples at which the nozzle is measured
  double hold_s = 0.0;        // how long the nozzle is watched after the base has come to rest
  double trace_step_s = 0.0;  // between samples of the traces; 0: no traces
  double trace_from_s = 0.0;  // begin of the traces in the plan
  double trace_to_s = 0.0;    // end of the traces in the plan

  [[nodiscard]] Nozzle nozzle() const {
    return two_stage.value_or(
        map_axes([](const compensate::AxisSetup& of) { return of.axis; }, unflex));
  }
};

// A stretch of motion from rest to rest.
struct Run {
  std::vector<planner::PlannedMove> plan;
  // A plan of the same path with half the acceleration, for the slow S-curve; empty: not tried.
  std::vector<planner::PlannedMove> slow_plan;
};

// The base as a method moves it over a run.
struct BaseMotion : Axes<rivals::AxisPath> {
  ProblemSize size = {};  // of both axes
  int iterations = 0;     // systems of equations solved for both axes; of unflex, of its engine
  std::string remark = {};
};

// How far the nozzle passes from corners of the path (unflex/verify/corners.hpp), over several
// runs.
struct CornerSums {
  std::size_t count = 0;
  double square_sum_mm2 = 0.0;
  double max_mm = 0.0;

  void add(const verify::CornerStats& run);
  void add(const CornerSums& other);
  // 0 without any corner.
  [[nodiscard]] double rms_mm() const;
};

// Distances of the nozzle from the path.
struct Straying {
  double max_mm = 0.0;           // while filament is laid
  double square_sum_mm2s = 0.0;  // ∫ distance² dt over the same time
  double time_s = 0.0;
  double max_at_s = 0.0;      // time of max_mm in the plan of the run
  double after_max_mm = 0.0;  // largest distance from the plan's end on
  CornerSums corners;

  [[nodiscard]] double rms_mm() const;
  void merge(const Straying& other);
};

// The motion of base and nozzle, for figures.
struct Trace {
  rivals::TimeGrid grid;
  std::vector<dynamics::NozzleMotionXY> base;
  std::vector<dynamics::NozzleMotionXY> nozzle;
  std::vector<double> error_mm;  // distance of the nozzle from the path
};

struct MethodResult {
  Method method = Method::uncompensated;
  bool used = false;   // the method could be used in every run
  std::string remark;  // why the method was not used, or a note on how it was used
  std::array<Straying, kFrequencyErrors.size()> straying;
  rivals::PeakMotion base_peak;  // of the axis with the larger one
  double end_gap_mm = 0.0;  // distance from the target at which the base comes to rest, larger axis
  double longer_s = 0.0;    // how much later than the plan the base comes to rest
  ProblemSize size;         // of both axes; as BaseMotion
  int iterations = 0;
  double base_s = 0.0;          // wall time in which the base was made
  std::size_t failed_runs = 0;  // runs without a solution; measured uncompensated
  Trace trace;                  // at the exact frequency; empty unless asked for
};

using BenchResult = std::vector<MethodResult>;  // one per method, in their order

// One run by all methods. The engine is used for unflex alone.
[[nodiscard]] BenchResult try_all(const Run& run, const BenchSetup& setup,
                                  const compensate::Engine& engine);

// The base as one method moves it. An error with the reason if the method cannot be used.
[[nodiscard]] Result<BaseMotion> base_by(Method method, const Run& run, const BenchSetup& setup,
                                         const compensate::Engine& engine);

// Adds the result of another run.
void merge(BenchResult& into, const BenchResult& run);

}  // namespace unflex::study
