// The machine as it is while a run is printed: it has one of its tools in use, and its frequencies
// may fall while the print grows, or change with height and place.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>

#include "unflex/machine/machine.hpp"
#include "unflex/run/run_job.hpp"

namespace unflex::run {

class MachineModel {
 public:
  // rules_for: makes the rules for a machine that stays as the settings say.
  MachineModel(const machine::Settings& settings,
               std::function<RunRules(const machine::Settings&)> rules_for);

  // The rules for the frequencies that the settings give.
  [[nodiscard]] const RunRules& as_given() const { return *given_; }
  // The rules for a run, or a part of one, in this state. Frequencies are within 0.05 % of the
  // state's. Rules are made anew only where the tool in use has others than at its last run.
  [[nodiscard]] std::shared_ptr<const RunRules> at(const machine::MachineState& state);

 private:
  machine::Settings settings_;
  std::function<RunRules(const machine::Settings&)> rules_for_;
  std::shared_ptr<const RunRules> given_;
  // Frequencies in steps, as FrequencyShare.
  struct Steps {
    std::int64_t by_print = 0;
    std::int64_t by_place = 0;

    bool operator==(const Steps&) const = default;
  };
  // The machine with one tool.
  struct OneTool {
    machine::Settings settings;
    std::shared_ptr<const RunRules> given;
    std::shared_ptr<const RunRules> present;
    Axes<Steps> steps;  // of present
  };
  OneTool& with_tool(int number);

  std::map<int, OneTool> tools_;  // by number; kOwn is the printer itself
};

}  // namespace unflex::run
