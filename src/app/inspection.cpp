#include "inspection.hpp"

#include <fmt/format.h>

#include <iterator>
#include <optional>
#include <string_view>

#include "unflex/app/run_config.hpp"
#include "unflex/core/number.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::app {
namespace {

using flow::Inspection;
using report::Json;
using Sink = std::back_insert_iterator<std::string>;

Json lines_json(const Inspection& i) {
  return {{"total", i.counts.lines},
          {"bytes", i.counts.bytes},
          {"passive", i.counts.passive_lines},
          {"limits", i.counts.limit_lines},
          {"barriers", i.counts.barrier_lines}};
}

Json moves_json(const Inspection& i) {
  return {{"total", i.counts.moves},
          {"extruding", i.counts.extruding_moves},
          {"extrude_only", i.counts.extrude_only_moves},
          {"arcs", i.counts.arcs},
          {"path_length_mm", i.path_length_mm},
          {"lowest_accel_mm_s2", i.lowest_accel_mm_s2},
          {"highest_accel_mm_s2", i.highest_accel_mm_s2},
          {"absolute_extrusion", i.absolute_e}};
}

// Widths in the table of settings.
constexpr int kKeyColumns = 44;
constexpr int kValueColumns = 14;

void write_counts(Sink out, const Inspection& i) {
  fmt::format_to(out, "dialect       {}\n", i.dialect.empty() ? "unknown" : i.dialect);
  fmt::format_to(out, "lines         {} ({:.1f} MB), {} of them stop the machine\n", i.counts.lines,
                 static_cast<double>(i.counts.bytes) * 1e-6, i.counts.barrier_lines);
  fmt::format_to(out, "moves         {}, {} extruding, {} of filament alone, {} arcs\n",
                 i.counts.moves, i.counts.extruding_moves, i.counts.extrude_only_moves,
                 i.counts.arcs);
  fmt::format_to(out, "extent        X {:.3f} to {:.3f}, Y {:.3f} to {:.3f}, Z to {:.3f} mm\n",
                 i.min_mm.x, i.max_mm.x, i.min_mm.y, i.max_mm.y, i.z_max_mm);
  fmt::format_to(out, "path          {:.0f} mm, filament {:.2f} mm ({} extrusion)\n",
                 i.path_length_mm, i.filament_mm, i.absolute_e ? "absolute" : "relative");
}

void write_time(Sink out, const Inspection& i) {
  fmt::format_to(out, "print time    {}, {} of it moving\n",
                 report::duration_text(i.reference_time_s), report::duration_text(i.moving_time_s));
  fmt::format_to(out, "runs          {} in {} windows, {} can be compensated\n", i.runs, i.windows,
                 report::duration_text(i.run_time_s));
  for (const auto& [reason, moves] : i.kept_moves) {
    fmt::format_to(out, "              {} moves stay as they are: {}\n", moves, reason);
  }
  if (i.extruded_path.total_mm > 0.0) {
    fmt::format_to(out, "              {} of {:.0f} mm extruded can be compensated\n",
                   report::share_text(i.extruded_path.compensated_share()),
                   i.extruded_path.total_mm);
  }
}

void write_limits(Sink out, const Inspection& i, const machine::Settings& s) {
  fmt::format_to(out, "accelerations {:.0f} to {:.0f} mm/s² in force during moves\n",
                 i.lowest_accel_mm_s2, i.highest_accel_mm_s2);
  fmt::format_to(out, "printer       {}, {} mm/s, {} mm/s², corners {} mm/s\n",
                 to_string(s.printer.firmware), readable(s.limits.max_velocity_mm_s),
                 readable(s.limits.max_accel_mm_s2),
                 readable(s.limits.square_corner_velocity_mm_s));
  fmt::format_to(out, "dynamics      X {}; Y {}\n", s.dynamics.x.description(),
                 s.dynamics.y.description());
}

// Each key that is not at its default, or every key, with its value in force when the print starts,
// and where the value is from.
void write_settings(Sink out, const machine::Settings& settings, bool all) {
  fmt::format_to(out, "settings\n");
  std::size_t folded = 0;
  for (const machine::SettingRow& row : machine::rows(settings)) {
    if (!all && row.origin == machine::kDefaultOrigin) {
      ++folded;
      continue;
    }
    fmt::format_to(out, "  {:<{}} {:<{}} {}\n", row.key, kKeyColumns,
                   row.value.empty() ? "-" : report::setting_text(row.value), kValueColumns,
                   row.origin);
  }
  if (folded > 0) {
    fmt::format_to(out, "  {} more are at their default; --all lists them\n", folded);
  }
}

void write_limits_in_print(Sink out, const Inspection& i, const std::string& input) {
  if (!i.limits.empty()) {
    fmt::format_to(out, "set by the print itself\n");
  }
  for (const auto& [key, limit] : i.limits) {
    fmt::format_to(out, "  {:<{}} {:<{}} {}:{}{}\n", key, kKeyColumns, readable(limit.first_value),
                   kValueColumns, input, limit.first_line,
                   limit.times > 1 ? fmt::format(", the first of {} times", limit.times) : "");
  }
}

Json limits_json(const Inspection& i) {
  Json json = Json::object();
  for (const auto& [key, limit] : i.limits) {
    json[key] = {{"first_value", limit.first_value},
                 {"first_line", limit.first_line},
                 {"times", limit.times}};
  }
  return json;
}

}  // namespace

std::string inspection_text(const Inspection& inspection, const std::string& input,
                            const machine::Settings& settings, bool all_settings) {
  std::string text = input + "\n";
  const Sink out = std::back_inserter(text);
  write_counts(out, inspection);
  write_time(out, inspection);
  text += report::unknown_text(inspection.unknown_commands);
  text += report::step_rates_text(inspection.step_rates, /*has_output=*/false);
  write_limits(out, inspection, settings);
  write_settings(out, settings, all_settings);
  write_limits_in_print(out, inspection, input);
  return text;
}

std::string inspection_json(const Inspection& i, const std::string& input,
                            const machine::Settings& settings) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "inspect";
  json["version"] = version();
  json["input"] = input;
  json["firmware"] = to_string(settings.printer.firmware);
  json["printer"] = report::settings_json(settings_in_force(settings));
  json["limits_in_print"] = limits_json(i);
  json["dialect"] = i.dialect;
  json["print_time_s"] = {
      {"reference", i.reference_time_s}, {"moving", i.moving_time_s}, {"runs", i.run_time_s}};
  json["lines"] = lines_json(i);
  json["commands"] = Json(i.commands);
  json["moves"] = moves_json(i);
  json["runs"] = {{"total", i.runs}};
  json["windows"] = {{"total", i.windows}};
  json["kept_moves"] = Json(i.kept_moves);
  json["extruded_path"] = report::path_json(i.extruded_path);
  json["unknown_commands"] = report::unknown_json(i.unknown_commands);
  json["step_rates"] = report::step_rates_json(i.step_rates, /*has_output=*/false);
  json["extrusion"] = {{"input_mm", i.filament_mm}};
  json["extent_mm"] = {{"x_min", i.min_mm.x},
                       {"x_max", i.max_mm.x},
                       {"y_min", i.min_mm.y},
                       {"y_max", i.max_mm.y},
                       {"z_max", i.z_max_mm}};
  json["warnings"] = i.warnings;
  return report::dump(json);
}

std::vector<report::Setting> settings_in_force(const machine::Settings& settings) {
  std::vector<report::Setting> list;
  for (machine::SettingRow& row : machine::rows(settings)) {
    list.push_back({std::move(row.key), std::move(row.value), std::move(row.origin)});
  }
  return list;
}

}  // namespace unflex::app
