// Whole prints, from their bytes to the bytes that the printer gets.
//
// The checks judge the output by its text alone, read as the printer reads it.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "bytes.hpp"
#include "own_limits.hpp"
#include "playback.hpp"
#include "program_writer.hpp"
#include "same_print.hpp"
#include "text_checks.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/gcode/compensable.hpp"
#include "unflex/gcode/time_note.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::fuzz {
namespace {

// Longer prints find nothing more and are slow, above all on firmwares with whole steps.
constexpr std::size_t kMostSegments = 3000;
double most_s(Firmware firmware) { return firmware == Firmware::klipper ? 2.0 : 0.3; }

// Whether there is little enough motion: in what may be rewritten, and in all.
bool is_short(const Playback& print, Firmware firmware) {
  constexpr double kMost_s = 100.0;
  double rewritten_s = 0.0;
  for (const planner::PlannedMove& move : print.moves) {
    rewritten_s += gcode::compensable(move.segment, firmware) ? move.duration_s() : 0.0;
  }
  return print.whole && rewritten_s < most_s(firmware) &&
         planner::duration_s(print.moves) < kMost_s;
}

// '0' to '2': the bytes are a print for Klipper, Marlin, RepRapFirmware. '3' to '5': the bytes are
// turned into such a print. The bytes '6' to ';', 'B' to 'G' and so on select these again, with
// other settings.
struct CompensateVariant {
  Firmware firmware;
  bool written;
  std::size_t settings;
};

constexpr std::size_t kSettings = 4;

CompensateVariant variant_of(Bytes& source) {
  constexpr std::array kFirmwares = {Firmware::klipper, Firmware::marlin, Firmware::rrf};
  const std::size_t variant = source.variant(6 * kSettings);
  return {kFirmwares[variant % 3], variant / 3 % 2 == 1, variant / 6};
}

machine::Settings settings_of(const CompensateVariant& variant) {
  const std::array<std::vector<std::string>, kSettings> kOverrides = {
      {{"printer.travel_x_mm=[0, 250]", "printer.travel_y_mm=[0, 210]"},
       {"dynamics.x.freq_hz=25", "dynamics.y.damping_ratio=0.15", "solve.lead_in_ms=4",
        "limits.max_accel_mm_s2=2000"},
       {"printer.travel_x_mm=[10, 81]", "printer.travel_y_mm=[19, 90]",
        "printer.retract_length_mm=0.6", "base.max_jerk_mm_s3=5e6", "emit.max_lines_per_s=150"},
       {"solve.window_s=0.3", "solve.overlap_s=0.03", "limits.max_accel_mm_s2=12000"}}};
  std::vector<std::string> overrides = kOverrides[variant.settings];
  overrides.push_back(fmt::format("printer.firmware=\"{}\"", to_string(variant.firmware)));
  const Result<machine::Settings> settings = machine::load(std::nullopt, overrides);
  require(settings.has_value(), settings ? "" : to_string(settings.error()));
  return *settings;
}

struct Compensated {
  report::Report report;
  std::string text;
};

Result<Compensated> run(const std::string& text, const machine::Settings& settings,
                        unsigned workers) {
  const flow::Job job{.input = memory_store(text),
                      .input_name = "in.gcode",
                      .output = memory_store(),
                      .output_name = "out.gcode",
                      .settings = settings,
                      .engine = flow::EngineChoice::banded,
                      .workers = workers};
  SilentProgress progress;
  return flow::compensate(job, progress).map([&](report::Report report) {
    return Compensated{std::move(report),
                       {std::istreambuf_iterator<char>(*job.output->read()), {}}};
  });
}

// Lines that must be in the output: all that do not move the machine.
std::vector<std::string> standing_lines(const Playback& playback) {
  std::vector<std::string> lines;
  for (const gcode::Event& event : playback.events) {
    if (event.kind != gcode::EventKind::move && !gcode::names_position(event.line.content())) {
      lines.emplace_back(event.line.content());
    }
  }
  return lines;
}

void check_lines_kept(const Playback& input, const Playback& output) {
  auto next = output.events.begin();
  for (const std::string& line : standing_lines(input)) {
    while (next != output.events.end() && !gcode::same_but_for_times(next->line.content(), line)) {
      ++next;
    }
    require(next != output.events.end(), "lost: " + line);
    ++next;
  }
}

void require_near(const char* what, double is, double wanted) {
  require(std::abs(is - wanted) <= 1e-5 * std::abs(wanted),
          fmt::format("{} is {} at the end instead of {}", what, is, wanted));
}

void check_limits(const planner::Limits& input, const planner::Limits& output, Firmware firmware) {
  if (firmware == Firmware::klipper) {
    require_near("velocity", output.max_velocity_mm_s, input.max_velocity_mm_s);
    require_near("acceleration", output.max_accel_mm_s2, input.max_accel_mm_s2);
    require_near("corner velocity", output.square_corner_velocity_mm_s,
                 input.square_corner_velocity_mm_s);
    require_near("cruise ratio", output.minimum_cruise_ratio, input.minimum_cruise_ratio);
    require_near("ACCEL_TO_DECEL", output.accel_to_decel_mm_s2, input.accel_to_decel_mm_s2);
    return;
  }
  for (std::size_t axis = 0; axis < 4; ++axis) {
    require_near("M203", output.axis_max_velocity_mm_s[axis], input.axis_max_velocity_mm_s[axis]);
    require_near("M201", output.axis_max_accel_mm_s2[axis], input.axis_max_accel_mm_s2[axis]);
    require_near("jerk", output.axis_jerk_mm_s[axis], input.axis_jerk_mm_s[axis]);
  }
  require_near("M204 P", output.print_accel_mm_s2, input.print_accel_mm_s2);
  require_near("M204 T", output.travel_accel_mm_s2, input.travel_accel_mm_s2);
  require_near("M204 R", output.retract_accel_mm_s2, input.retract_accel_mm_s2);
  require_near("M205 J", output.junction_deviation_mm, input.junction_deviation_mm);
  require_near("M205 B", output.min_segment_time_s, input.min_segment_time_s);
  require(input.jerk_policy == output.jerk_policy, "the jerk policy is another at the end");
}

void check_end(const Playback& input, const Playback& output, const machine::Settings& settings) {
  for (const auto axis : {gcode::X, gcode::Y, gcode::Z, gcode::E}) {
    const double expected = input.end.position_mm[axis];
    const double tolerance = 2e-5 + 1e-12 * std::abs(expected);
    require(std::abs(output.end.position_mm[axis] - expected) <= tolerance,
            fmt::format("{} ends at {} mm instead of {} mm", "XYZE"[axis],
                        output.end.position_mm[axis], expected));
    // An unknown reading is not corrected.
    require(std::abs(output.end.base_mm[axis] - input.end.base_mm[axis]) <= tolerance ||
                !input.end.known[axis],
            fmt::format("the zero of {} is {} mm instead of {} mm", "XYZE"[axis],
                        output.end.base_mm[axis], input.end.base_mm[axis]));
  }
  require(input.end.known == output.end.known, "other axes are known at the end");
  const auto modes = [](const gcode::ModalState& state) {
    return fmt::format("G9{} M8{} unit {} M220 {} M221 {} retracted {} G{} shaper {} {}",
                       state.absolute_xyz ? 0 : 1, state.absolute_e ? 2 : 3, state.unit_mm,
                       state.speed_factor, state.flow_factor, state.retraction.retracted,
                       state.plane, state.shaper.freq_hz.x, state.shaper.freq_hz.y);
  };
  require(modes(input.end) == modes(output.end),
          fmt::format("{} at the end instead of {}", modes(output.end), modes(input.end)));
  require_near("F", output.end.feed_mm_s, input.end.feed_mm_s);
  check_limits(input.limits, output.limits, settings.printer.firmware);
}

void check_report(const report::Report& report) {
  require(report.violation_count == 0, fmt::format("{} violations: {}", report.violation_count,
                                                   fmt::join(report.violations, "; ")));
  // Two runs with only a rounding of filament between them are verified as one run.
  require(report.runs.compensated + report.runs.fallback <= report.runs.total,
          "more runs than there are");
  for (const std::string& warning : report.warnings) {
    require_one_line(warning);
  }
  require(!report::to_json(report).empty() && !report::to_text(report).empty(),
          "nothing to report");
}

}  // namespace

void compensate(std::string_view bytes) {
  Bytes source(bytes);
  const CompensateVariant variant = variant_of(source);
  const machine::Settings settings = settings_of(variant);
  const PrinterSetup setup{machine::interpreter_options(settings),
                           machine::planner_limits(settings), machine::firmware_config(settings)};
  const std::string print =
      variant.written ? ProgramWriter(setup.interpreter, most_s(variant.firmware)).program(source)
                      : std::string(source.rest());
  const std::string text = testing::numbered(print);
  const Playback input = play(text, setup, kMostSegments);
  if (!is_short(input, variant.firmware)) {
    return;
  }
  const Result<Compensated> done = run(text, settings, 1);
  if (!done) {
    return require_fault_of_input(done.error());
  }
  check_report(done->report);
  const Playback output = play(done->text, setup, kMostSegments + text.size() * 100'000);
  check_lines_kept(input, output);
  check_end(input, output, settings);
  if (!testing::has_marks(print)) {
    const std::string difference =
        testing::difference(text, done->text, testing::printer_with(settings));
    require(difference.empty(), difference);
  }
  if (variant.settings == kSettings - 1) {
    const Result<Compensated> again = run(text, settings, 2);
    require(again && again->text == done->text, "two threads write another text than one");
  }
}

}  // namespace unflex::fuzz
