// Checks of a run besides the rules of its motion, and of all that must be the same in both files.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "regime_check.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "verifier.hpp"

namespace unflex::verify {
namespace {

// One rounding step of E, and half of one for a remainder carried in.
constexpr double kFilamentTolerance_mm = 1.5e-5 + 1e-9;

// Type and damping of a shaper that is off are of no effect.
// A shaper that is not known cannot be restored.
bool same_shaper(const gcode::ModalState& a, const gcode::ModalState& b) {
  const bool same_freqs =
      all_axes([](bool unknown, double of_a, double of_b) { return unknown || of_a == of_b; },
               a.shaper.unknown, a.shaper.freq_hz, b.shaper.freq_hz);
  const auto is_same = [](double freq_hz, const auto& of_a, const auto& of_b) {
    return freq_hz == 0.0 || of_a == of_b;
  };
  const bool same_types =
      all_axes(is_same, a.shaper.freq_hz, a.shaper.settings.type, b.shaper.settings.type);
  const bool same_damping = all_axes(is_same, a.shaper.freq_hz, a.shaper.settings.damping_ratio,
                                     b.shaper.settings.damping_ratio);
  // Only a firmware with one shaper for both axes has such words.
  const bool same_words =
      is_same(a.shaper.freq_hz.x, a.shaper.settings.custom_words, b.shaper.settings.custom_words);
  return same_freqs && same_types && same_damping && same_words;
}

}  // namespace

// M221 scales the filament of a rounding step of E.
double Verifier::filament_tolerance_mm() const {
  // Marlin lays the filament of a move that is too short for it with the next move, which may be
  // after the run.
  const planner::FirmwareConfig& firmware = rules_.fixed;
  const double too_short_mm = spec_of(firmware.firmware).motion.skips_short_moves
                                  ? firmware.min_steps_per_segment / firmware.steps_per_mm[gcode::E]
                                  : 0.0;
  return too_short_mm + kFilamentTolerance_mm * std::max(1.0, output_.replay().filament_factor());
}

void Verifier::check_run(bool compensated) {
  if (const Excursion::Side* const side = output_.excursion().worse_than(input_.excursion())) {
    violations_.in_output(side->line,
                          fmt::format("X{:.4f} Y{:.4f} is out of the travel by {:.4f} mm",
                                      side->place_mm.x, side->place_mm.y, side->beyond_mm));
  }
  if (output_.too_much_line() != 0 && input_.too_much_line() == 0) {
    violations_.in_output(output_.too_much_line(),
                          "so much filament is too much for so short a way");
  }
  const double difference_mm = output_.pushed_in_section_mm() - filament_.input_mm();
  if (std::abs(difference_mm) > filament_tolerance_mm()) {
    violations_.in_output(
        output_.replay().following().line.number,
        fmt::format("the run before lays {:.5f} mm of filament instead of {:.5f} mm",
                    output_.pushed_in_section_mm(), filament_.input_mm()));
  }
  totals_.measured.worst_move_extrusion_error_mm =
      std::max({totals_.measured.worst_move_extrusion_error_mm, filament_.worst_move_error_mm(),
                std::abs(difference_mm)});
  if (compensated) {
    base_.end_run();
    for (StepBreach& breach : run_steps_.breaches()) {
      violations_.in_output(breach.line, std::move(breach.message));
    }
    rules_of_run_.end(rate_, kept_, emitted_.main(), base_.accel_limit_mm_s2());
    if (!paths_.has_sliced_moves()) {
      violations_.in_output(output_.replay().following().line.number,
                            "the run before is not in the sliced file");
    }
  }
}

void Verifier::check_flow() {
  constexpr double kMore = 1.01;
  const FlowStats& flow = output_.flow().section();
  const double sliced_mm3_s = input_.flow().section().max_mm3_s;
  if (flow.max_mm3_s <= kMore * std::max(rules_.max_flow_mm3_s, sliced_mm3_s) ||
      (totals_.too_much_flow && flow.max_mm3_s <= totals_.too_much_flow->flow_mm3_s)) {
    return;
  }
  totals_.too_much_flow = {flow.max_mm3_s, sliced_mm3_s, flow.max_line};
}

// Where unflex sets pressure advance for runs, what is laid outside of them gets it as sliced.
// The smooth time may stay until the end and until the machine moves by itself.
void Verifier::check_advance(bool with_smooth_time, std::size_t line) {
  const planner::FirmwareAdvance sliced = advance_of(input_.section());
  const planner::FirmwareAdvance present = advance_of(output_.section());
  if (rules_.line.is_written &&
      (with_smooth_time ? sliced != present : sliced.advance_s != present.advance_s)) {
    violations_.in_output(line, "the printer's pressure advance is not restored");
  }
}

bool Verifier::sections_agree() {
  const Section& input = input_.section();
  const Section& output = output_.section();
  if (input.kind != output.kind || !same_line(input.line, output.line)) {
    const auto name = [](const Section& section) {
      return section.kind == SectionKind::end ? std::string("the end of the file")
                                              : fmt::format("'{}'", section.line.content());
    };
    violations_.in_output(
        output.line.number,
        fmt::format(
            "structure differs: {} instead of {} (line {} of the sliced file); not compared "
            "any further",
            name(output), name(input), input.line.number));
    return false;
  }
  lines_.pass(input, output);
  check_regime(input, output);
  return true;
}

void Verifier::check_regime(const Section& input, const Section& output) {
  const std::size_t line = output.line.number;
  const Regime& before = *input.regime;
  const Regime& after = *output.regime;
  if (const std::string difference = modal_difference(before.modal, after.modal);
      !difference.empty()) {
    violations_.in_output(line, fmt::format("state before this line: {}", difference));
  }
  if (const std::string difference = limits_difference(before.limits, after.limits);
      !difference.empty()) {
    violations_.in_output(line, fmt::format("limits not restored: {}", difference));
  }
  // Kept motion between compensated runs may pass without the shaper, because each switch is a
  // stop. The shaper must be restored at the end and before the machine moves by itself.
  const bool shaper_matters = input.kind == SectionKind::end || input.moves_by_itself;
  if (shaper_matters) {
    check_advance(true, line);
  }
  if (shaper_matters && !same_shaper(before.modal, after.modal)) {
    violations_.in_output(line, "the printer's input shaper is not restored");
  }
}

// A firmware takes another tool while the machine stands still, and needs some time for it. So the
// nozzles of the other tool are at rest.
void Verifier::follow_tool() {
  if (!tools_.take(input_.section().tool, rules_)) {
    return;
  }
  for_sliced([&](Nozzles& nozzles) { nozzles.set_models(tools_.nozzles()); });
  emitted_.set_models(tools_.nozzles());
  kept_.set_models({coarse(rules_.nozzle)});
}

}  // namespace unflex::verify
