// Interface for watching a verification. It costs nothing if there is no observer.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

// The base that a nozzle hangs on.
enum class NozzleBase {
  sliced,    // the sliced file's plan, as long as the printer has used no shaper
  shaped,    // what the printer's own shaper has made of that plan
  unshaped,  // that plan beside `shaped`, as if the printer had no shaper
  emitted,   // the emitted file's motion as the printer plays it
};

// Tells the nozzles of a verification apart.
struct NozzleId {
  NozzleBase base = NozzleBase::sliced;
  std::size_t model = 0;  // 0: Rules::nozzle; i + 1: Observation::detuned[i]
};

// One step of the integration, at its end.
struct NozzleStep {
  double time_s = 0.0;  // on the clock of the nozzle's reference
  double h_s = 0.0;
  dynamics::NozzleMotionXY nozzle;
  dynamics::BaseXY base;
  // Whether the base's motion lays filament.
  bool extruding = false;
  // The square of the distance from the path, its mean during the step, and its largest value
  // during the step or just before. Then the line of the sliced file that is nearest to the nozzle.
  // Set while the reference moves or filament is laid.
  double contour2_mm2 = 0.0;
  double mean_contour2_mm2 = 0.0;
  double largest_contour2_mm2 = 0.0;
  std::size_t line = 0;  // the first nozzle's, for the others too
  // Whether the reference moves. Only then the fields after `waiting` are set.
  bool measured = false;
  // The base has ended early and rests while the reference runs on. The nozzle state is reset
  // afterwards.
  bool waiting = false;
  XY reference_mm;
  std::size_t piece = 0;  // piece of the reference's path
};

// A bin of a line of plastic, once all that comes out there has come out (Rules::line).
struct WidthBin {
  std::size_t path = 0;  // number of the line of plastic, from 1 on
  double error = 0.0;    // of the width, as a share of what the sliced file asks for
};

class Observer {
 public:
  virtual ~Observer() = default;
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  // A line of the sliced file has been read. It comes before the moves that it makes.
  virtual void line(const gcode::Line& line) = 0;
  // A section (a run or a single move) begins. Its pieces will be appended to both paths. They are
  // different paths if the run is measured against its own plan. Then the n-th piece of the section
  // is the same move in both.
  virtual void section(const ReferencePath& sliced, const ReferencePath& emitted) = 0;
  virtual void step(NozzleId nozzle, const NozzleStep& step) = 0;
  // The line that lies below this nozzle. Few ask for it.
  virtual void width(NozzleId /*nozzle*/, const WidthBin& /*bin*/) {}
  // The base stands still for duration_s, between sections.
  virtual void hold(double duration_s) = 0;
  // All nozzles on the sliced file's plan have been moved to this time of `sliced`.
  virtual void advanced(const ReferencePath& sliced, double time_s) = 0;
  // For how long a piece of the sliced path is still needed after its time, s.
  [[nodiscard]] virtual double memory_s() const = 0;
  // Whether the observer asks for the sliced file without the printer's own shaper at other
  // frequencies.
  [[nodiscard]] virtual bool asks_for_unshaped() const = 0;

 protected:
  Observer() = default;
};

// Relative errors of the frequencies, rising, for which detuned nozzles are measured.
inline constexpr std::array<double, 6> kFrequencyErrors = {-0.15, -0.10, -0.05, 0.05, 0.10, 0.15};

// `model` with each of kFrequencyErrors.
[[nodiscard]] std::vector<NozzleModel> detuned(const NozzleModel& model);

// The nozzles to measure besides the rules' nozzle, and who watches.
struct Observation {
  // Further nozzles that hang on the same two bases: those of verify::detuned() first, which a
  // recorder needs, then any others.
  std::vector<NozzleModel> detuned;
  Observer* observer = nullptr;
  // What `detuned` is while each of Rules::tools is in use: as many for each.
  std::vector<std::vector<NozzleModel>> detuned_by_tool = {};
};

}  // namespace unflex::verify
