// A bench of places: the best single input shaper for the whole bed against one optimum per place,
// on a machine whose frequencies change over the bed.
//
// A firmware has one frequency per axis for its shaper. unflex knows the place of each line. So
// each kind of shaper is tuned to do best where it is worst, and is then measured at each place.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "unflex/compensate/run.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/study/bench.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {

// The machine at one place of the bed: its axes, and the setup of unflex for them.
struct MapPlace {
  XY place_mm;
  compensate::Setup unflex;
};

struct MapContender {
  std::string name;                 // "as sliced", "unflex", or of a shaper
  Axes<double> freq_hz = {};        // what a shaper is tuned to; 0 for the others
  std::vector<double> rms_mm = {};  // contour error of extruding moves, at each place

  [[nodiscard]] double worst_mm() const;
};

struct MapOutcome {
  std::string version;
  std::string input;
  std::vector<report::Setting> printer;
  std::vector<XY> places_mm;
  std::vector<Axes<double>> freq_hz;     // of the machine, at each place
  std::vector<MapContender> contenders;  // as sliced, the shapers, unflex
  double measured_s = 0.0;               // of the print
  std::size_t failed_runs = 0;  // runs without a solution at some place; measured uncompensated
  std::vector<std::string> warnings;

  // The shaper whose worst place is the best.
  [[nodiscard]] const MapContender& best_shaper() const;
  [[nodiscard]] const MapContender& unflex() const { return contenders.back(); }
};

// Measures run by run.
class MapBench {
 public:
  // places: at least one.
  MapBench(std::vector<MapPlace> places, const Options& options);
  ~MapBench();
  MapBench(MapBench&&) noexcept;
  MapBench& operator=(MapBench&&) = delete;

  // The nozzle begins each run at rest. Runs beyond kMapPrint_s of motion are left out.
  void add(const std::vector<Run>& runs);
  [[nodiscard]] MapOutcome outcome() const;

 private:
  struct Measured;
  std::vector<MapPlace> places_;
  Options options_;
  std::unique_ptr<Measured> measured_;
};

// So much of a print's motion tells enough.
inline constexpr double kMapPrint_s = 60.0;

[[nodiscard]] std::string to_text(const MapOutcome& outcome);
// The keys are those of docs/report.md.
[[nodiscard]] std::string to_json(const MapOutcome& outcome);

}  // namespace unflex::study
