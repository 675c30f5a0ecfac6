// The machine as it is while a run is printed: a bed carries all that has been printed so far.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "unflex/machine/machine.hpp"
#include "unflex/run/run_job.hpp"

namespace unflex::run {

class MachineModel {
 public:
  // rules_for: makes the rules for a machine that stays as the settings say.
  MachineModel(const machine::Settings& settings,
               std::function<RunRules(const machine::Settings&)> rules_for);

  // The rules for the empty bed.
  [[nodiscard]] const RunRules& empty() const { return *empty_; }
  // The rules for a run, or a part of one, while this length of filament lies on the bed, mm.
  // Frequencies are within 0.05 % of those of its mass.
  [[nodiscard]] std::shared_ptr<const RunRules> at(double printed_mm);

 private:
  machine::Settings settings_;
  std::function<RunRules(const machine::Settings&)> rules_for_;
  std::shared_ptr<const RunRules> empty_;
  std::shared_ptr<const RunRules> present_;
  std::int64_t step_ = 0;  // of present_
};

}  // namespace unflex::run
