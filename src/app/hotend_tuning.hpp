// The result of `hotend`, and its output as text, JSON and a page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "unflex/hotend/closed_loop.hpp"
#include "unflex/hotend/fit.hpp"
#include "unflex/hotend/log.hpp"
#include "unflex/hotend/plant.hpp"
#include "unflex/hotend/rules.hpp"

namespace unflex::app {

// A rule's gains, and what a simulated controller makes of them.
struct RuleOutcome {
  hotend::Rule rule = hotend::kDefaultRule;
  hotend::Gains gains;
  std::optional<hotend::Response> step;  // none without a model
  std::optional<hotend::Response> load;  // none unless HotendTuning::load is there
};

// Heat that filament takes.
struct HotendLoad {
  double flow_mm3_s = 0.0;
  double power_w = 0.0;
  double counts = 0.0;
};

// A log and the model in it, or the closest that there is.
struct HotendLog {
  std::string name;
  hotend::Log log;
  hotend::PlantFit fit;
  std::string refusal;  // why the model is not used and what to do; empty if it is
};

struct HotendTuning {
  std::string heater = "extruder";
  std::optional<HotendLog> log;
  std::optional<hotend::Plant> plant;  // none for a test, and for a log that carries none
  std::optional<hotend::Ultimate> ultimate;
  std::optional<double> heater_w;
  hotend::Rule rule = hotend::kDefaultRule;  // the chosen one
  double target_c = 0.0;
  std::optional<HotendLoad> load;
  std::vector<RuleOutcome> rules;  // all that can be had; empty if the log is refused
  std::vector<std::string> warnings;

  // The outcome of the chosen rule. It is there unless the log is refused.
  [[nodiscard]] const RuleOutcome* chosen() const;
};

// The gains in the words of the firmwares.
[[nodiscard]] std::string words_text(const HotendTuning& tuning);

// The lines for the printer file; empty unless a log of a hotend has given a model.
[[nodiscard]] std::string model_snippet(const HotendTuning& tuning);

[[nodiscard]] std::string tuning_text(const HotendTuning& tuning);
[[nodiscard]] std::string tuning_json(const HotendTuning& tuning);
[[nodiscard]] std::string tuning_html(const HotendTuning& tuning);

}  // namespace unflex::app
