#include "facts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <utility>

#include "unflex/report/format.hpp"

namespace unflex::report {
namespace {

// Names and values, in the order in which they are shown.
class Facts {
 public:
  void add(std::string name, std::string value) {
    facts_.push_back({std::move(name), std::move(value)});
  }
  [[nodiscard]] const Json& json() const { return facts_; }

 private:
  Json facts_ = Json::array();
};

void add_work(Facts& facts, const Report& r) {
  facts.add("Sliced file", r.input);
  facts.add("Compensated file", r.output);
  facts.add("Firmware", r.firmware);
  facts.add("Print time", fmt::format("{} as sliced, {} compensated",
                                      duration_text(r.measured.uncompensated.time_s),
                                      duration_text(r.measured.compensated.time_s)));
  if (!r.solver.engine.empty()) {
    facts.add("Stretches of motion",
              fmt::format("{} of {} compensated, {} stay as sliced", r.runs.compensated,
                          r.runs.total, r.runs.fallback));
    facts.add("Extruded path", fmt::format("{} of {:.0f} mm compensated",
                                           share_text(r.extruded_path.compensated_share()),
                                           r.extruded_path.total_mm));
    facts.add("Solver", fmt::format("{}, {} parts, {} iterations", r.solver.engine,
                                    r.runs.windows_total, r.solver.iterations));
  }
  for (std::size_t i = 0; i < std::min(r.unknown_commands.size(), kMostListed); ++i) {
    const UnknownCommand& unknown = r.unknown_commands[i];
    facts.add("Unknown command",
              fmt::format("{}, {}×, first in line {}: {} moves behind it stay as they are",
                          unknown.command.substr(0, kLongestText), unknown.count,
                          unknown.first_line, unknown.moves_kept));
  }
}

void add_nozzle(Facts& facts, const Report& r) {
  if (!r.others.plants.empty()) {
    facts.add("If the axes are as one of the plants",
              fmt::format("{} µm RMS", range_text(r.others.plants, &PlantDeviation::compensated)));
  }
  if (r.others.robustness) {
    facts.add("Suits several models",
              fmt::format("{} µm RMS as optimised, {} for the nominal alone",
                          micrometres_text(r.others.robustness->rms_mm),
                          micrometres_text(r.others.robustness->nominal_rms_mm)));
  }
  if (r.measured.unshaped) {
    facts.add("Without the printer's own shaper",
              fmt::format("{} µm RMS and {} µm at most before",
                          micrometres_text(r.measured.unshaped->extruding.contour_rms_mm),
                          micrometres_text(r.measured.unshaped->extruding.contour_max_mm)));
  }
  const verify::CornerStats& corners = r.measured.uncompensated.corners;
  const verify::CornerStats& left = r.measured.compensated.corners;
  if (corners.count > 0) {
    facts.add(
        fmt::format("Distance from {} corners", corners.count),
        fmt::format("{} → {} µm RMS, 99 % within {} → {} µm, {} → {} µm at most, as sliced in line "
                    "{}, compensated in line {}",
                    micrometres_text(corners.rms_mm), micrometres_text(left.rms_mm),
                    micrometres_text(corners.p99_mm), micrometres_text(left.p99_mm),
                    micrometres_text(corners.max_mm), micrometres_text(left.max_mm),
                    corners.max_line, left.max_line));
  }
}

void add_output(Facts& facts, const Report& r) {
  facts.add("Output",
            fmt::format("{} lines, {:.1f} MB, at most {:.0f} lines/s", r.measured.output.lines,
                        static_cast<double>(r.measured.output.bytes) * 1e-6,
                        r.measured.output.max_lines_per_s));
  facts.add("Filament",
            fmt::format("{:.2f} mm in, {:.2f} mm out", r.measured.uncompensated.extrusion_mm,
                        r.measured.compensated.extrusion_mm));
  if (r.fitted_filament) {
    const FittedFilament& fitted = *r.fitted_filament;
    facts.add(
        "Filament fitted before",
        fmt::format("{:.2f} mm of moves that print became {:.2f} mm, E × {:.5f} to {:.5f}, {:.1f} "
                    "mm³ of material; the print ends at {:.1f} mm of the filament",
                    fitted.sliced_mm, fitted.fitted_mm, fitted.least_factor, fitted.most_factor,
                    fitted.material_mm3, fitted.end_mm));
  }
}

void add_line(Facts& facts, const verify::Measured& measured) {
  if (measured.uncompensated.line.is_known()) {
    const verify::LineStats& before = measured.uncompensated.line;
    const verify::LineStats& after = measured.compensated.line;
    facts.add(
        "Edges of the line",
        fmt::format("{} → {} µm RMS, 99 % within {} → {} µm, {} → {} µm at most, as sliced in line "
                    "{}, compensated in line {}",
                    micrometres_text(before.edge.rms_mm), micrometres_text(after.edge.rms_mm),
                    micrometres_text(before.edge.p99_mm), micrometres_text(after.edge.p99_mm),
                    micrometres_text(before.edge.max_mm), micrometres_text(after.edge.max_mm),
                    before.edge.line, after.edge.line));
    facts.add(
        "Width of the line if the hotend is another",
        fmt::format("{} % RMS with 20 % less pressure, {} with more; {} with 2 ms more dead time",
                    width_change_text(before, after, verify::OtherHotend::less_pressure),
                    width_change_text(before, after, verify::OtherHotend::more_pressure),
                    width_change_text(before, after, verify::OtherHotend::later)));
  } else {
    facts.add("Filament laid ahead of the nozzle or behind",
              fmt::format("{} → {} µm RMS, {} → {} µm at most",
                          micrometres_text(measured.uncompensated.lag.rms_mm),
                          micrometres_text(measured.compensated.lag.rms_mm),
                          micrometres_text(measured.uncompensated.lag.max_mm),
                          micrometres_text(measured.compensated.lag.max_mm)));
  }
}

void add_flow(Facts& facts, const Report& r) {
  const verify::FlowStats& flow = r.measured.uncompensated.flow;
  const verify::FlowStats& asked = r.measured.compensated.flow;
  facts.add(
      "Flow of filament",
      fmt::format(
          "{:.1f} → {:.1f} mm³/s at most, as sliced in line {}, compensated in line {} of "
          "the output; it changes by {:.0f} → {:.0f} mm³/s² at most, in lines {} and {}{}",
          flow.max_mm3_s, asked.max_mm3_s, flow.max_line, asked.max_line, flow.max_change_mm3_s2,
          asked.max_change_mm3_s2, flow.max_change_line, asked.max_change_line,
          r.max_flow_mm3_s ? fmt::format("; the hotend melts {:.1f} mm³/s", *r.max_flow_mm3_s)
                           : std::string{}));
  if (r.measured.flow_difference) {
    facts.add("Rate of filament beside the sliced file",
              flow_difference_text(*r.measured.flow_difference));
  }
}

}  // namespace

Json facts_json(const Report& r) {
  Facts facts;
  add_work(facts, r);
  add_nozzle(facts, r);
  add_output(facts, r);
  add_line(facts, r.measured);
  add_flow(facts, r);
  if (!r.step_rates.motors.empty()) {
    facts.add("Step rates", step_rates_list(r.step_rates, /*has_output=*/true));
  }
  facts.add("Written by", fmt::format("unflex {}", r.version));
  return facts.json();
}

}  // namespace unflex::report
