// The keys are documented in docs/report.md; a test holds the two together.

#include "answers.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::report {
namespace {

constexpr int kIndentation = 2;

// Settings come as TOML literals (numbers, switches, quoted words, pairs), which JSON shares.
Json literal(const std::string& text) {
  if (text.empty()) {
    return nullptr;
  }
  Json value = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  return value.is_discarded() ? Json(text) : value;
}

Json row_json(const verify::DeviationStats& row) {
  return {{"contour_max_mm", row.contour_max_mm},    {"contour_p99_mm", row.contour_p99_mm},
          {"contour_rms_mm", row.contour_rms_mm},    {"tracking_max_mm", row.tracking_max_mm},
          {"tracking_rms_mm", row.tracking_rms_mm},  {"duration_s", row.duration_s},
          {"contour_max_line", row.contour_max_line}};
}

Json corners_json(const verify::CornerStats& row) {
  return {{"count", row.count},
          {"rms_mm", row.rms_mm},
          {"p99_mm", row.p99_mm},
          {"max_mm", row.max_mm},
          {"max_line", row.max_line}};
}

Json width_json(const verify::WidthStats& row) {
  return {{"rms", row.rms},
          {"p99", row.p99},
          {"largest", row.largest},
          {"wide", row.wide},
          {"line", row.line}};
}

Json line_json(const verify::LineStats& row) {
  return {{"width", width_json(row.width)},
          {"edge",
           {{"rms_mm", row.edge.rms_mm},
            {"p99_mm", row.edge.p99_mm},
            {"max_mm", row.edge.max_mm},
            {"line", row.edge.line}}},
          {"first_mm", {{"rms", row.first.rms}, {"mean", row.first.mean}}},
          {"last_mm", {{"rms", row.last.rms}, {"mean", row.last.mean}}},
          {"less_pressure", width_json(row.width_with(verify::OtherHotend::less_pressure))},
          {"more_pressure", width_json(row.width_with(verify::OtherHotend::more_pressure))},
          {"earlier", width_json(row.width_with(verify::OtherHotend::earlier))},
          {"later", width_json(row.width_with(verify::OtherHotend::later))}};
}

Json laid_line_json(const verify::Measured& measured) {
  const verify::LineStats& before = measured.uncompensated.line;
  if (!before.is_known()) {
    return nullptr;
  }
  return {{"length_mm", before.length_mm},
          {"uncompensated", line_json(before)},
          {"compensated", line_json(measured.compensated.line)}};
}

Json flow_json(const verify::FlowStats& row) {
  return {{"max_mm3_s", row.max_mm3_s},
          {"max_line", row.max_line},
          {"max_change_mm3_s2", row.max_change_mm3_s2},
          {"max_change_line", row.max_change_line}};
}

Json spread_json(const Spread& s) {
  return {{"contour_max_mm", s.max_mm}, {"contour_rms_mm", s.rms_mm}};
}

Json sensitivity_json(const std::vector<Sensitivity>& sensitivity) {
  Json array = Json::array();
  for (const Sensitivity& one : sensitivity) {
    array.push_back({{"frequency_error", one.frequency_error},
                     {"uncompensated", spread_json(one.uncompensated)},
                     {"compensated", spread_json(one.compensated)}});
  }
  return array;
}

Json plants_json(const std::vector<PlantDeviation>& plants) {
  Json array = Json::array();
  for (const PlantDeviation& plant : plants) {
    array.push_back({{"uncompensated", spread_json(plant.uncompensated)},
                     {"compensated", spread_json(plant.compensated)}});
  }
  return array;
}

Json rows_json(const verify::Deviation& rows) {
  return {{"extruding", row_json(rows.extruding)}, {"all", row_json(rows.all)}};
}

Json places_json(const verify::Measured& measured) {
  const auto of = [](const verify::PlaceErrors& places) {
    Json json = {{"squares", Json::array()}, {"bands", Json::array()}};
    for (const verify::PlaceErrors::Square& square : places.squares) {
      json["squares"].push_back({{"x_mm", square.x_mm},
                                 {"y_mm", square.y_mm},
                                 {"contour_rms_mm", square.error.rms_mm},
                                 {"duration_s", square.error.duration_s}});
    }
    for (const verify::PlaceErrors::Band& band : places.bands) {
      json["bands"].push_back({{"from_mm", band.from_mm},
                               {"contour_rms_mm", band.error.rms_mm},
                               {"duration_s", band.error.duration_s}});
    }
    return json;
  };
  const auto& before = measured.uncompensated.places;
  const auto& after = measured.compensated.places;
  return before && after ? Json{{"uncompensated", of(*before)}, {"compensated", of(*after)}}
                         : Json();
}

Json height_json(const verify::Measured& measured) {
  const auto& before = measured.uncompensated.height;
  const auto& after = measured.compensated.height;
  const auto row = [](const verify::HeightStats& stats) {
    return Json{{"max_mm", stats.max_mm}, {"rms_mm", stats.rms_mm}};
  };
  return before && after ? Json{{"uncompensated", row(*before)}, {"compensated", row(*after)}}
                         : Json();
}

Json fallbacks_json(const std::vector<Fallback>& fallbacks) {
  Json array = Json::array();
  for (const Fallback& fallback : fallbacks) {
    array.push_back({{"first_line", fallback.first_line},
                     {"last_line", fallback.last_line},
                     {"reason", fallback.reason}});
  }
  return array;
}

Json budget_json(const LineBudget& budget) {
  Json above = Json::array();
  for (const AboveBudget& place : budget.above) {
    above.push_back({{"first_line", place.first_line},
                     {"last_line", place.last_line},
                     {"lines_per_s", place.lines_per_s}});
  }
  return {{"max_lines_per_s", budget.max_lines_per_s},
          {"places_above", budget.places_above},
          {"above", above},
          {"cost_rms_mm", budget.cost_rms_mm},
          {"cost_max_mm", budget.cost_max_mm}};
}

Json comparison_json(const std::optional<Comparison>& comparison) {
  if (!comparison) {
    return nullptr;
  }
  return {{"now_rms_mm", comparison->now_mm},
          {"compensated_rms_mm", comparison->compensated_mm},
          {"zv_rms_mm", comparison->zv_mm ? Json(*comparison->zv_mm) : Json(nullptr)}};
}

Json place_json(const Report& r, const std::optional<Place>& place, double Place::*error_mm) {
  if (!place) {
    return nullptr;
  }
  const Recording& recording = *r.recording;
  const bool named = place->feature < recording.features.size();
  return {{"contour_max_mm", (*place).*error_mm},
          {"line", place->line},
          {"layer", slicers_layer(recording, place->layer)},
          {"feature", named ? recording.features[place->feature].name : std::string{}},
          {"x_mm", place->xy_mm.x},
          {"y_mm", place->xy_mm.y},
          {"z_mm", place->z_mm}};
}

Json shapers_json(const Report& r) {
  Json array = Json::array();
  if (!r.recording) {
    return array;
  }
  for (const Contender& contender : r.recording->contenders) {
    Json errors = Json::array();
    for (std::size_t i = 0; i < contender.spreads.size(); ++i) {
      errors.push_back({{"frequency_error", r.recording->frequency_errors[i]},
                        {"contour_rms_mm", contender.spreads[i].rms_mm},
                        {"contour_max_mm", contender.spreads[i].max_mm}});
    }
    array.push_back({{"name", contender.name},
                     {"corner_rms_mm",
                      contender.corner_rms_mm ? Json(*contender.corner_rms_mm) : Json(nullptr)},
                     {"errors", std::move(errors)}});
  }
  return array;
}

// The answers that the summary begins with.
void add_answers(const Report& r, Json& json) {
  const Better first = better(r);
  const Worst second = worst(r);
  const Safe third = safe(r);
  json["answers"] = {
      {"better",
       {{"now", first.now},
        {"exact", comparison_json(first.exact)},
        {"off_by_5_percent", comparison_json(first.off)},
        {"edge", comparison_json(first.edge)}}},
      {"worst",
       {{"now", place_json(r, second.now, &Place::before_mm)},
        {"compensated", place_json(r, second.compensated, &Place::after_mm)}}},
      {"start_now_max_mm", second.start ? Json(second.start->before.max_mm) : Json(nullptr)},
      {"start_compensated_max_mm", second.start ? Json(second.start->after.max_mm) : Json(nullptr)},
      {"safe",
       {{"is_safe", third.is_safe},
        {"times_own_accel", third.times_own_accel},
        {"reasons", third.reasons}}},
      {"made_for", made_for_text(r)}};
  json["contenders"] = shapers_json(r);
}

void add_motion(const Report& r, Json& json) {
  json["print_time_s"] = {{"reference", r.measured.uncompensated.time_s},
                          {"emitted", r.measured.compensated.time_s}};
  json["freq_error"] = r.others.freq_error;
  json["sensitivity"] = sensitivity_json(r.others.sensitivity);
  json["deviation"] = {{"uncompensated", rows_json(r.measured.uncompensated)},
                       {"unshaped", r.measured.unshaped ? rows_json(*r.measured.unshaped) : Json()},
                       {"compensated", rows_json(r.measured.compensated)}};
  json["corners"] = {{"uncompensated", corners_json(r.measured.uncompensated.corners)},
                     {"compensated", corners_json(r.measured.compensated.corners)}};
  json["height"] = height_json(r.measured);
  json["places"] = places_json(r.measured);
  json["laid_line"] = laid_line_json(r.measured);
  json["plants"] = plants_json(r.others.plants);
  json["robustness"] = nullptr;
  if (r.others.robustness) {
    json["robustness"] = {{"rms_mm", r.others.robustness->rms_mm},
                          {"nominal_rms_mm", r.others.robustness->nominal_rms_mm}};
  }
  json["base"] = {{"max_velocity_mm_s", r.measured.base.max_velocity_mm_s},
                  {"max_accel_mm_s2", r.measured.base.max_accel_mm_s2},
                  {"max_step_mm_s", r.measured.base.max_step_mm_s},
                  {"accel_limit_mm_s2", r.measured.base.accel_limit_mm_s2},
                  {"own_max_velocity_mm_s", r.facts.motor_max_velocity_mm_s},
                  {"own_max_accel_mm_s2", r.facts.motor_max_accel_mm_s2},
                  {"own_max_accel_origin", r.facts.motor_max_accel_origin}};
}

void add_timing(const Report& r, Json& json) {
  const FreeTiming& timing = r.free_timing;
  json["timing"] = nullptr;
  if (timing.tolerance_mm > 0.0) {
    json["timing"] = {
        {"tolerance_mm", timing.tolerance_mm},
        {"contour_p999_mm", r.measured.compensated.extruding.contour_p999_mm},
        {"speed_of_feed_p999", r.measured.compensated_feed.p999},
        {"speed_of_feed_max", r.measured.compensated_feed.max},
        {"speed_of_feed_max_line", r.measured.compensated_feed.max_line},
        {"pieces_as_sliced", timing.pieces_as_sliced},
        {"as_sliced", fallbacks_json(timing.as_sliced)},
        {"pieces_scaled", timing.pieces_scaled},
        {"scaled", fallbacks_json(timing.scaled)},
        {"narrower", timing.narrower ? Json{{"freq_error", timing.narrower->freq_error},
                                            {"saves_s", timing.narrower->saves_s}}
                                     : Json(nullptr)}};
  }
}

void add_work(const Report& r, Json& json) {
  if (r.solver.engine.empty()) {
    // Nothing was solved: an existing file was verified. How it was made is not known.
    for (const char* const key : {"windows", "fallbacks", "kept_moves", "extruded_path",
                                  "unknown_commands", "line_budget", "solver", "shaper_left_off"}) {
      json[key] = nullptr;
    }
    json["runs"] = {{"total", nullptr}, {"compensated", r.runs.compensated}, {"fallback", nullptr}};
    return;
  }
  json["windows"] = {{"total", r.runs.windows_total},
                     {"solved", r.runs.windows_solved},
                     {"fallback", r.runs.windows_fallback}};
  json["runs"] = {
      {"total", r.runs.total}, {"compensated", r.runs.compensated}, {"fallback", r.runs.fallback}};
  json["fallbacks"] = fallbacks_json(r.runs.fallbacks);
  json["kept_moves"] = Json(r.runs.kept_moves);
  json["extruded_path"] = path_json(r.extruded_path);
  json["unknown_commands"] = unknown_json(r.unknown_commands);
  json["line_budget"] = budget_json(r.line_budget);
  json["solver"] = {{"engine", r.solver.engine},
                    {"iterations", r.solver.iterations},
                    {"checked_windows", r.solver.check.windows},
                    {"largest_gap", r.solver.check.largest_gap},
                    {"largest_difference_mm", r.solver.check.largest_difference_mm}};
  json["shaper_left_off"] = r.shaper_left_off;
}

void add_output(const Report& r, Json& json) {
  json["output_stats"] = {{"lines", r.measured.output.lines},
                          {"bytes", r.measured.output.bytes},
                          {"max_lines_per_s", r.measured.output.max_lines_per_s},
                          {"segment_ms_median", r.measured.output.segment_ms_median},
                          {"worst_run_drift_ms", 1e3 * r.measured.worst_run_drift_s}};
  json["extrusion"] = {{"input_mm", r.measured.uncompensated.extrusion_mm},
                       {"output_mm", r.measured.compensated.extrusion_mm},
                       {"worst_move_error_mm", r.measured.worst_move_extrusion_error_mm},
                       {"lag_rms_mm", r.measured.compensated.lag.rms_mm},
                       {"lag_max_mm", r.measured.compensated.lag.max_mm},
                       {"lag_max_line", r.measured.compensated.lag.max_line},
                       {"uncompensated_lag_rms_mm", r.measured.uncompensated.lag.rms_mm},
                       {"uncompensated_lag_max_mm", r.measured.uncompensated.lag.max_mm},
                       {"uncompensated_lag_max_line", r.measured.uncompensated.lag.max_line}};
  json["fitted_filament"] = nullptr;
  if (r.fitted_filament) {
    const FittedFilament& fitted = *r.fitted_filament;
    json["fitted_filament"] = {
        {"sliced_mm", fitted.sliced_mm},       {"fitted_mm", fitted.fitted_mm},
        {"material_mm3", fitted.material_mm3}, {"least_factor", fitted.least_factor},
        {"most_factor", fitted.most_factor},   {"end_mm", fitted.end_mm}};
  }
  json["flow"] = {{"uncompensated", flow_json(r.measured.uncompensated.flow)},
                  {"compensated", flow_json(r.measured.compensated.flow)},
                  {"largest_difference", nullptr},
                  {"largest_difference_line", nullptr},
                  {"difference_p99", nullptr}};
  if (r.measured.flow_difference) {
    json["flow"]["largest_difference"] = r.measured.flow_difference->relative;
    json["flow"]["largest_difference_line"] = r.measured.flow_difference->line;
    json["flow"]["difference_p99"] = r.measured.flow_difference->p99;
  }
  json["step_rates"] = step_rates_json(r.step_rates, /*has_output=*/true);
  json["temperature"] = temperature_json(r.temperature);
  json["performance"] = {{"wall_s", r.performance.wall_s},
                         {"cpu_s", r.performance.cpu_s},
                         {"print_s_per_wall_s", r.performance.print_s_per_wall_s},
                         {"peak_rss_mb", r.performance.peak_rss_mb}};
  json["violation_count"] = r.violation_count;
  json["violations"] = r.violations;
  json["warnings"] = r.warnings;
}

}  // namespace

Json path_json(const ExtrudedPath& path) {
  return {{"total_mm", path.total_mm},
          {"compensated_mm", path.compensated_mm},
          {"compensated_share", path.compensated_share()},
          {"kept_mm", Json(path.kept_mm)}};
}

Json unknown_json(const std::vector<UnknownCommand>& commands) {
  Json array = Json::array();
  for (const UnknownCommand& unknown : commands) {
    array.push_back({{"command", unknown.command},
                     {"count", unknown.count},
                     {"first_line", unknown.first_line},
                     {"moves_kept", unknown.moves_kept},
                     {"kept_mm", unknown.kept_mm}});
  }
  return array;
}

Json settings_json(const std::vector<Setting>& settings) {
  Json object = Json::object();
  for (const Setting& setting : settings) {
    object[setting.key] = {{"value", literal(setting.value)}, {"origin", setting.origin}};
  }
  return object;
}

std::string dump(const Json& json) {
  return json.dump(kIndentation, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) +
         "\n";
}

std::string to_json(const Report& report) {
  Json json;
  json["schema_version"] = kSchemaVersion;
  json["command"] = report.command;
  json["version"] = report.version;
  json["input"] = report.input;
  json["output"] = report.output;
  json["firmware"] = report.firmware;
  json["printer"] = settings_json(report.printer);
  add_answers(report, json);
  add_motion(report, json);
  add_timing(report, json);
  add_work(report, json);
  add_output(report, json);
  return dump(json);
}

}  // namespace unflex::report
