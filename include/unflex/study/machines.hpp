// A bench of real machines: unflex as `identify` sets it up for a record and the input shapers that
// Klipper's calibration sets up for the same record, on a machine that another fit, or another
// record, tells of.
#pragma once

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
  MachineAxis x;
  MachineAxis y;
  compensate::Setup unflex;  // the axes as they are known, and what the printer allows
};

enum class Contender { uncompensated, zv, mzv, ei, recommended, unflex };
inline constexpr std::size_t kContenderCount = 6;
[[nodiscard]] std::string_view name(Contender contender);

// Distances of the nozzle from the path while filament is laid.
struct ContenderResult {
  double rms_mm = 0.0;
  double p99_mm = 0.0;
  double max_mm = 0.0;
};

struct MachineResult {
  std::string name;
  std::string description;  // records, models and shapers
  std::array<ContenderResult, kContenderCount> contenders;
  std::size_t failed_runs = 0;  // runs without a solution; measured uncompensated

  // The best of ZV, MZV, EI and what Klipper recommends, by RMS.
  [[nodiscard]] const ContenderResult& best_shaper() const;
  [[nodiscard]] const ContenderResult& of(Contender contender) const {
    return contenders[static_cast<std::size_t>(contender)];
  }
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
