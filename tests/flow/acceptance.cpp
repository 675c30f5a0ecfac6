#include "acceptance.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <vector>

#include "jobs.hpp"
#include "own_limits.hpp"
#include "same_print.hpp"

namespace unflex::flow::testing {
namespace {

using unflex::testing::Printer;
using unflex::testing::TextMachine;

// Filament error that one output line may add: half a step of E in rounding, and noise of summing.
constexpr double kFilamentStepMm = 1e-5 + 1e-8;
// Filament follows the nozzle. The nozzle passes from move to move when the plan does, within some
// tens of micrometres. Where Klipper would brake for a jump of the flow, the jump is spread over
// lines.
constexpr double kFilamentOfNozzleMm = 5e-3;
// A line between two moves may be put where the nearest output line begins, which is up to half of
// the shortest line away. Besides, the base is ahead of the path by what bends the machine.
constexpr double kPlaceMm = 0.6;
constexpr double kPlaceFilamentMm = 0.02;

// Whether the line is G0 to G3 with a word for X, Y, Z or E, by its letters alone.
bool is_motion(std::string_view line) {
  std::string code;
  bool in_parentheses = false;
  for (const char c : line) {
    if (c == ';') {
      break;
    }
    in_parentheses = c == '(' || (in_parentheses && c != ')');
    if (!in_parentheses && c != ')' && std::isspace(static_cast<unsigned char>(c)) == 0) {
      code += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  const std::size_t number_end = code.find_first_not_of("0123456789", 1);
  if (code.size() < 2 || code[0] != 'G' || number_end == std::string::npos || number_end == 1) {
    return false;
  }
  const std::string number = code.substr(1, number_end - 1);
  constexpr std::array<std::string_view, 8> kMotion = {"0", "1", "2", "3", "00", "01", "02", "03"};
  return std::ranges::find(kMotion, number) != kMotion.end() &&
         code.find_first_of("XYZE", number_end) != std::string::npos;
}

// A line that unflex adds to raise and restore limits and to correct modes and coordinates.
bool is_own(std::string_view line) {
  constexpr std::array<std::string_view, 11> kBeginnings = {";unflex",
                                                            "SET_VELOCITY_LIMIT ",
                                                            "SET_INPUT_SHAPER ",
                                                            "SET_PRESSURE_ADVANCE ",
                                                            "G1 F",
                                                            "G92 E",
                                                            "G90",
                                                            "G91",
                                                            "M82",
                                                            "M83",
                                                            "G2"};
  return std::ranges::any_of(kBeginnings,
                             [&](std::string_view start) { return line.starts_with(start); });
}

// A line without motion, and where the machine was when it came.
struct Standing {
  std::string text;
  std::array<double, 3> at_mm{};
  double filament_mm = 0.0;
};

std::vector<Standing> standing_lines(const std::string& text, const Printer& printer) {
  std::vector<Standing> lines;
  TextMachine machine(printer.firmware, printer.retraction);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    const std::string line = text.substr(begin, end - begin);
    if (!is_motion(line)) {
      lines.push_back({line, machine.reading().position_mm, machine.reading().filament_mm});
    }
    machine.read(line.substr(0, line.find('\n')));
    begin = end;
  }
  return lines;
}

void expect_same_place(const Standing& in, const Standing& out) {
  EXPECT_NEAR(out.at_mm[0], in.at_mm[0], kPlaceMm) << in.text;
  EXPECT_NEAR(out.at_mm[1], in.at_mm[1], kPlaceMm) << in.text;
  EXPECT_NEAR(out.at_mm[2], in.at_mm[2], 0.02) << in.text;
  EXPECT_NEAR(out.filament_mm, in.filament_mm, kPlaceFilamentMm) << in.text;
}

// The line without its duration, which follows the emitted print time.
std::string but_for_durations(const std::string& line) {
  if (line.starts_with(";TIME")) {
    return line.substr(0, line.find(':'));
  }
  if (line.starts_with("; estimated") && line.find("printing time") != std::string::npos) {
    return line.substr(0, line.find('='));
  }
  std::string result;
  const bool progress = line.starts_with("M73 ");
  bool in_duration = false;
  for (const char c : line) {
    in_duration = progress && (c == 'R' || c == 'S' ||
                               (in_duration && std::isdigit(static_cast<unsigned char>(c)) != 0));
    if (!in_duration) {
      result += c;
    }
  }
  return result;
}

void expect_kept(const report::Report& report, const machine::Settings& settings) {
  EXPECT_EQ(report.violation_count, 0U) << complaints(report);
  EXPECT_GT(report.runs.total, 0U);
  EXPECT_EQ(report.runs.total, report.runs.compensated + report.runs.fallback);
  EXPECT_LE(report.runs.fallback, report.runs.total / 1000) << complaints(report);
  EXPECT_EQ(report.runs.fallbacks.size(), report.runs.fallback);
  EXPECT_EQ(report.runs.windows_total, report.runs.windows_solved + report.runs.windows_fallback);
  EXPECT_LE(report.measured.compensated.time_s, 1.01 * report.measured.uncompensated.time_s);
  EXPECT_LE(report.measured.base.max_accel_mm_s2, settings.base_max_accel_mm_s2());
  EXPECT_LE(report.measured.base.max_velocity_mm_s, settings.base_max_velocity_mm_s());
  EXPECT_LE(report.measured.output.max_lines_per_s, settings.max_lines_per_s());
  EXPECT_NEAR(report.measured.compensated.extrusion_mm, report.measured.uncompensated.extrusion_mm,
              kFilamentStepMm);
  EXPECT_LE(report.measured.worst_move_extrusion_error_mm, kFilamentOfNozzleMm);
}

void expect_true_path(const report::Report& report, double improvement) {
  const verify::DeviationStats& before = unshaped(report).extruding;
  const verify::DeviationStats& after = report.measured.compensated.extruding;
  EXPECT_GT(after.duration_s, 0.0);
  EXPECT_LE(report.measured.compensated.lag.rms_mm, 10e-3);
  EXPECT_LT(report.measured.compensated.lag.rms_mm, report.measured.uncompensated.lag.rms_mm);
  EXPECT_LE(after.contour_rms_mm, 0.8e-3);
  EXPECT_LE(after.contour_p99_mm, 4e-3);
  EXPECT_LE(after.contour_rms_mm, before.contour_rms_mm / improvement)
      << "from " << before.contour_rms_mm;
}

// Every line of the input without motion stands in the output, byte for byte, in order, and at its
// place along the path. Any other output line is motion or a line of unflex's own.
void expect_lines_kept(const std::string& input, const std::string& output,
                       const Printer& printer) {
  const std::vector<Standing> in = standing_lines(input, printer);
  const std::vector<Standing> out = standing_lines(output, printer);
  std::size_t next = 0;
  for (const Standing& line : in) {
    const std::string wanted = but_for_durations(line.text);
    while (next < out.size() && but_for_durations(out[next].text) != wanted) {
      EXPECT_TRUE(is_own(out[next].text)) << out[next].text;
      ++next;
    }
    ASSERT_LT(next, out.size()) << "lost: " << line.text;
    expect_same_place(line, out[next]);
    if (::testing::Test::HasFailure()) {
      return;
    }
    ++next;
  }
  for (; next < out.size(); ++next) {
    EXPECT_TRUE(is_own(out[next].text)) << out[next].text;
  }
}

}  // namespace

void expect_compensated(const std::string& input, const Expectation& expectation) {
  const std::string sliced = unflex::testing::numbered(input);
  const JobFolder folder(sliced);
  const Job job = folder.job(expectation.workers);
  SilentProgress progress;
  const Result<report::Report> report = compensate(job, progress);
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  expect_kept(*report, job.settings);
  expect_true_path(*report, expectation.improvement);
  const std::string emitted = folder.output();
  const Printer printer = unflex::testing::printer_with(job.settings);
  expect_lines_kept(sliced, emitted, printer);
  EXPECT_EQ(unflex::testing::difference(sliced, emitted, printer), "");
  for (const auto& [name, value] :
       {std::pair{"before_rms_um", unshaped(*report).extruding.contour_rms_mm * 1e3},
        std::pair{"rms_um", report->measured.compensated.extruding.contour_rms_mm * 1e3},
        std::pair{"p99_um", report->measured.compensated.extruding.contour_p99_mm * 1e3},
        std::pair{"max_um", report->measured.compensated.extruding.contour_max_mm * 1e3}}) {
    ::testing::Test::RecordProperty(name, fmt::format("{:.3f}", value));
  }
}

}  // namespace unflex::flow::testing
