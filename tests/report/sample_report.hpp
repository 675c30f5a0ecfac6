// A report in which every field has a value of its own.
#pragma once

#include "unflex/report/report.hpp"

namespace unflex::report {

inline verify::DeviationStats sample_row(double scale) {
  return {.contour_max_mm = 1.0 * scale,
          .contour_p99_mm = 0.5 * scale,
          .contour_rms_mm = 0.25 * scale,
          .tracking_max_mm = 2.0 * scale,
          .tracking_rms_mm = 0.75 * scale,
          .duration_s = 100.0 * scale,
          .contour_max_line = 17};
}

// A line that primes the nozzle, and two layers.
inline Recording sample_recording() {
  Recording recording;
  recording.layers = {{0.2, 12, {{0.9, 0.5}, {0.05, 0.01}}, 0},
                      {0.2, 40, {{0.7, 0.2}, {0.012, 0.004}}, 0},
                      {0.4, 90, {{0.8, 0.2}, {0.010, 0.003}}, 0}};
  recording.start_layers = 1;
  recording.features = {{"", 1.0, {}}, {"Perimeter", 9.0, {}}};
  Place place;
  place.line = 95;
  place.layer = 2;
  place.feature = 1;
  place.xy_mm = {20.04, 30.0};
  place.before_mm = 0.8;
  recording.worst_before = {place};
  place.line = 41;
  place.layer = 1;
  place.feature = 0;
  place.xy_mm.y = -2.26;
  place.after_mm = 0.012;
  recording.worst_after = {place};
  recording.frequency_errors = {-0.05, 0.0, 0.05};
  recording.contenders = {
      {"as sliced", {{0.9, 0.23}, {0.8, 0.2}, {0.7, 0.15}}, true, 0.06},
      {"unflex", {{0.02, 0.005}, {0.0125, 0.003}, {0.02, 0.0061}}, true, 0.0005},
      {"ZV", {{0.03, 0.008}, {0.02, 0.004}, {0.04, 0.009}}, true, std::nullopt},
      {"EI", {}, true, std::nullopt}};
  return recording;
}

inline Report sample_report() {
  Report r;
  verify::Measured& m = r.measured;
  r.command = "compensate";
  r.version = "0.1.0";
  r.input = "cube.gcode";
  r.output = "out.gcode";
  r.firmware = "klipper";
  r.printer = {{"printer.firmware", "\"klipper\"", "default"},
               {"printer.travel_x_mm", "[0, 250]", "printer.toml:3"},
               {"printer.travel_y_mm", "", "default"},
               {"limits.max_accel_mm_s2", "5000", "--set"},
               {"solve.jerk_weight", "1e-07", "default"}};
  r.facts = {{{"X", "45 Hz, ζ 0.06", "printer.toml:7"}, {"Y", "38.5 Hz, ζ 0.1", "--set"}},
             "MZV 45 Hz",
             false,
             300.0,
             8000.0,
             "--set",
             "X 0 to 250, Y 0 to 210 mm",
             "Klipper from its own storage",
             1000.0};
  m.uncompensated.time_s = 3600.0;
  m.compensated.time_s = 3618.0;
  m.uncompensated.extruding = sample_row(0.8);
  m.uncompensated.all = sample_row(1.6);
  m.unshaped = {.extruding = sample_row(0.9), .all = sample_row(1.8)};
  m.compensated.extruding = sample_row(0.0125);
  m.compensated.all = sample_row(0.025);
  m.uncompensated.corners = {321, 0.06, 0.11, 0.12, 41};
  m.compensated.corners = {321, 0.0005, 0.0025, 0.015, 43};
  m.uncompensated.line = {6800.0,
                          {0.06, 0.31, 0.7, 0.09, 812},
                          {0.016, 0.08, 0.2, 813},
                          {},
                          {},
                          {{{0.05, 0.2, 0.5, 0.07, 814},
                            {0.09, 0.4, 0.8, 0.12, 815},
                            {0.06, 0.31, 0.7, 0.09, 812},
                            {0.07, 0.35, 0.75, 0.1, 816}}}};
  m.compensated.line = {6800.0,
                        {0.005, 0.021, -0.09, 0.001, 817},
                        {0.002, 0.0066, 0.02, 818},
                        {},
                        {},
                        {{{0.07, 0.3, -0.4, 0.08, 819},
                          {0.055, 0.25, 0.3, 0.06, 820},
                          {0.005, 0.021, -0.09, 0.001, 817},
                          {0.04, 0.2, 0.25, 0.04, 821}}}};
  r.others.freq_error = 0.1;
  r.others.sensitivity = {{-0.1, {0.9, 0.2}, {0.03, 0.012}}, {0.05, {0.7, 0.15}, {0.02, 0.0061}}};
  r.others.plants = {{{0.8, 0.18}, {0.02, 0.004}}, {{0.7, 0.15}, {0.03, 0.009}}};
  r.others.robustness = {0.003, 0.0005};
  m.base.max_velocity_mm_s = 123.0;
  m.base.max_accel_mm_s2 = 19999.0;
  m.base.max_step_mm_s = 27.5;
  m.base.accel_limit_mm_s2 = 20000.0;
  r.runs.total = 900;
  r.runs.compensated = 895;
  r.runs.fallback = 5;
  r.runs.windows_total = 1000;
  r.runs.windows_solved = 994;
  r.runs.windows_fallback = 6;
  r.free_timing = {.tolerance_mm = 0.02,
                   .pieces_as_sliced = 1,
                   .as_sliced = {{50, 60, "base acceleration above the limit"}},
                   .pieces_scaled = 2,
                   .scaled = {{40, 49, "it is a part of a long motion"}},
                   .narrower = report::NarrowerBand{0.05, 432.0}};
  m.compensated.extruding.contour_p999_mm = 0.0188;
  m.compensated_feed = {1.012, 1.019, 77};
  r.runs.fallbacks = {{10, 20, "no solution"}, {30, 44, "worse than the original"}};
  r.runs.kept_moves = {{"Z move", 12}};
  r.extruded_path = {8000.0, 7000.0, {{"run left as sliced", 900.0}, {"start unknown", 100.0}}};
  r.unknown_commands = {{"M1234", 40, 12, 7, 100.0}, {"MY_MACRO", 1, 90, 0, 0.0}};
  r.line_budget = {850.0, 2, {{70, 75, 880.0}, {90, 91, 890.0}}, 0.0005, 0.0075};
  r.solver.engine = "ipopt 3.11.9";
  r.solver.iterations = 4242;
  r.solver.check = {8, 3e-9, 2e-6};
  m.output.lines = 123456;
  m.output.bytes = 4500000;
  m.output.max_lines_per_s = 890.0;
  m.output.segment_ms_median = 2.5;
  m.worst_run_drift_s = 4e-5;
  m.uncompensated.extrusion_mm = 1234.5;
  m.compensated.extrusion_mm = 1234.75;
  m.worst_move_extrusion_error_mm = 0.00001;
  m.uncompensated.lag = {0.06, 0.5, 700};
  m.compensated.lag = {0.0045, 0.035, 801};
  r.fitted_filament = {100.0, 110.5, 240.5, 1.1, 1.12, 108.5};
  m.uncompensated.flow = {10.5, 710, 400.0, 711};
  m.compensated.flow = {12.4, 811, 500.0, 812};
  m.flow_difference = verify::FlowDifference{-0.125, 813, 0.0625};
  r.max_flow_mm3_s = 15.0;
  r.temperature = Temperature{5.0,
                              true,
                              {21.3, 1.5, -19.8, 210, 24.0},
                              {1.3, 8.2, 14.9, 1410, 12.0},
                              {{211, 20.1, 200.0, 220.0}},
                              {{10.0, 200.0, 200.25}, {20.0, 220.0, 214.5}}};
  r.step_rates = {{{"X", 80.0, 24000.0, 30, 31200.0, 812}, {"E", 500.0, 1250.0, 40, 1300.0, 0}},
                  {"", 0.0, 25000.0, 30, 32000.0, 812},
                  50000.0};
  r.performance.wall_s = 90.0;
  r.performance.cpu_s = 170.0;
  r.performance.print_s_per_wall_s = 40.0;
  r.performance.peak_rss_mb = 64.0;
  r.violations = {"out.gcode:7: outside the travel"};
  r.violation_count = 3;
  r.warnings = {"cube.gcode:1: warning: no G28"};
  r.recording = sample_recording();
  return r;
}

}  // namespace unflex::report
