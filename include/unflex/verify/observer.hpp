// Watches a verification. Nothing of it costs anything when nobody does.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

// Which of the nozzles is meant.
struct NozzleId {
  bool emitted = false;   // hangs on the emitted file's base, not on the sliced file's plan
  std::size_t model = 0;  // 0: of the rules; i + 1: Observation::detuned[i]
};

// One step of the integration, at its end.
struct NozzleStep {
  double time_s = 0.0;  // on the clock of the nozzle's reference
  double h_s = 0.0;
  dynamics::NozzleXY nozzle;
  dynamics::BaseSegment base_x;
  dynamics::BaseSegment base_y;
  // Whether the reference moves. Only then the following are set.
  bool measured = false;
  // The base has ended before the reference: it stands still, and what follows goes on from where
  // the nozzle was when that began.
  bool waiting = false;
  bool extruding = false;
  double reference_x_mm = 0.0;
  double reference_y_mm = 0.0;
  std::size_t piece = 0;  // of the reference
  double contour2_mm2 = 0.0;
  std::size_t line = 0;  // of the sliced file, nearest to the nozzle
};

class Observer {
 public:
  virtual ~Observer() = default;
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  // Lines of the sliced file, each before the moves that it makes.
  virtual void line(const gcode::Line& line) = 0;
  // A section (a run, or a single move) begins: its pieces come at the ends of these, which are two
  // where the run is measured against its own plan. The n-th piece of both is the same move.
  virtual void section(const ReferencePath& sliced, const ReferencePath& emitted) = 0;
  virtual void step(NozzleId nozzle, const NozzleStep& step) = 0;
  // The base stands still for so long, between sections.
  virtual void hold(double duration_s) = 0;
  // All nozzles on the sliced file's plan have been moved to this time of `sliced`.
  virtual void advanced(const ReferencePath& sliced, double time_s) = 0;
  // For how long after its time the sliced file's path is still needed.
  [[nodiscard]] virtual double memory_s() const = 0;

 protected:
  Observer() = default;
};

// By how much true frequencies may be off, for what that would do.
inline constexpr std::array<double, 4> kFrequencyErrors = {-0.10, -0.05, 0.05, 0.10};

// The nozzle with each of these errors.
[[nodiscard]] std::vector<NozzleModel> detuned(const NozzleModel& model);

// What else to measure, and for whom.
struct Observation {
  // Other nozzles, on the same two bases.
  std::vector<NozzleModel> detuned;
  Observer* observer = nullptr;
};

}  // namespace unflex::verify
