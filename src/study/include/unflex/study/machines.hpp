// A bench of real machines: unflex as `identify` sets it up for a record and the input shapers that
// Klipper's calibration sets up for the same record, on a machine that another fit, or another
// record, tells of.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "unflex/compensate/run.hpp"
#include "unflex/core/error.hpp"
#include "unflex/rivals/klipper_calibration.hpp"
#include "unflex/study/bench.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {

struct MachineAxis {
  std::string known_from;  // names of records
  std::string truth_from;
  std::vector<dynamics::Mode> truth;
  rivals::KlipperCalibration shapers;
};

struct Machine {
  std::string name;
  Axes<MachineAxis> axes;
  compensate::Setup unflex;  // the axes as they are known, and what the printer allows
};

enum class Contender { uncompensated, zv, mzv, ei, recommended, unflex };
inline constexpr std::size_t kContenderCount = 6;
[[nodiscard]] std::string_view name(Contender contender);

// By tomorrow a machine differs from its record: a spool, a part that grows and another test shift
// all its frequencies. So each machine is measured with all frequencies of its truth off by these
// shares.
inline constexpr std::array<double, 3> kMachineShifts = {-0.07, 0.0, 0.07};
inline constexpr std::size_t kNoShift = 1;

struct ContenderResult {
  // Distances of the nozzle from the path while filament is laid.
  double rms_mm = 0.0;
  double p99_mm = 0.0;
  double max_mm = 0.0;
  // How far the nozzle passes from corners of the path (unflex/verify/corners.hpp); 0 without any.
  double corner_rms_mm = 0.0;
  double corner_max_mm = 0.0;
};

struct MachineResult {
  std::string name;
  std::string description;  // records, models and shapers
  using AllContenders = std::array<ContenderResult, kContenderCount>;
  std::array<AllContenders, kMachineShifts.size()> shifted;
  std::size_t corners = 0;      // of the print
  std::size_t failed_runs = 0;  // runs without a solution; measured uncompensated

  // The best of ZV, MZV, EI and what Klipper recommends, by RMS.
  [[nodiscard]] const ContenderResult& best_shaper(std::size_t shift = kNoShift) const;
  [[nodiscard]] const ContenderResult& of(Contender contender, std::size_t shift = kNoShift) const {
    return shifted[shift][static_cast<std::size_t>(contender)];
  }
  // The RMS of unflex divided by the RMS of the best shaper; 0 if the latter is 0.
  [[nodiscard]] double ratio(std::size_t shift) const;
};

struct MachinesOutcome {
  std::string version;
  std::string input;
  std::vector<report::Setting> printer;
  std::vector<MachineResult> machines;
  std::vector<std::string> warnings;
};

// Measures one machine run by run.
class MachineBench {
 public:
  MachineBench(Machine machine, const Options& options);
  ~MachineBench();
  MachineBench(MachineBench&&) noexcept;
  MachineBench& operator=(MachineBench&&) = delete;

  // The nozzle begins each run at rest.
  void add(const std::vector<Run>& runs);
  [[nodiscard]] MachineResult result() const;

 private:
  struct Measured;
  Machine machine_;
  Options options_;
  std::unique_ptr<Measured> measured_;
};

[[nodiscard]] std::string to_text(const MachinesOutcome& outcome);
// The keys are those of docs/study.md.
[[nodiscard]] std::string to_json(const MachinesOutcome& outcome);
[[nodiscard]] std::string to_html(const MachinesOutcome& outcome);

}  // namespace unflex::study
