#include "printer_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/planner/printer_shaper.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::flow {
namespace {

// "MZV 48"
std::string shaper_text(std::string type, double freq_hz) {
  if (!(freq_hz > 0.0)) {
    return "none";
  }
  std::ranges::transform(type, type.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  return fmt::format("{} {:.4g}", type, freq_hz);
}

std::string origin_of(const machine::Settings& settings, std::string_view key) {
  const auto found =
      std::ranges::find(settings.origins, key, &std::pair<std::string, std::string>::first);
  return found != settings.origins.end() ? found->second : std::string(machine::kDefaultOrigin);
}

// An axis is given by its modes, by its stiffness or by one frequency.
std::string origin_of_axis(const machine::Settings& settings, const std::string& axis) {
  for (const std::string key : {".mode", ".freq_hz", ".stiffness_n_mm"}) {
    std::string origin = origin_of(settings, "dynamics." + axis + key);
    if (origin != machine::kDefaultOrigin) {
      return origin;
    }
  }
  return std::string(machine::kDefaultOrigin);
}

std::string travel_text(const machine::PrinterSettings& printer) {
  if (!printer.travel_x_mm || !printer.travel_y_mm) {
    return {};
  }
  return fmt::format("X {:g} to {:g}, Y {:g} to {:g} mm", printer.travel_x_mm->min,
                     printer.travel_x_mm->max, printer.travel_y_mm->min, printer.travel_y_mm->max);
}

std::string lines_source(const machine::PrinterSettings& printer) {
  if (printer.transport == "serial") {
    return "a host that waits for each line";
  }
  const FirmwarePrinters& printers = spec_of(printer.firmware).printers;
  return std::string(printer.transport == "sbc" && !printers.lines_from_sbc.empty()
                         ? printers.lines_from_sbc
                         : printers.lines_from);
}

}  // namespace

std::optional<record::PrinterShaper> printer_shaper(const verify::Rules& rules) {
  gcode::Shaper shaper;
  shaper.freq_x_hz = rules.interpreter.shaper_freq_x_hz;
  shaper.freq_y_hz = rules.interpreter.shaper_freq_y_hz;
  planner::Shaping shaping = planner::shaping(rules.fixed, shaper);
  if (!shaping.acts()) {
    return std::nullopt;
  }
  const planner::InstalledShaper& installed = rules.fixed.shaper;
  std::string name = shaper_text(installed.type_x, shaper.freq_x_hz);
  if (const std::string y = shaper_text(installed.type_y, shaper.freq_y_hz); y != name) {
    const bool differs_in_hz_only =
        installed.type_x == installed.type_y && !shaping.x.empty() && !shaping.y.empty();
    name += "/" + (differs_in_hz_only ? fmt::format("{:.4g}", shaper.freq_y_hz) : y);
  }
  return record::PrinterShaper{name + " Hz", std::move(shaping.x), std::move(shaping.y)};
}

report::PrinterFacts printer_facts(const machine::Settings& settings) {
  report::PrinterFacts facts;
  facts.axes = {{"X", settings.dynamics_x.description(), origin_of_axis(settings, "x")},
                {"Y", settings.dynamics_y.description(), origin_of_axis(settings, "y")}};
  if (const auto own = printer_shaper(run::verify_rules(settings))) {
    facts.shaper = own->name;
  }
  facts.shaper_unknown = settings.shaper_unknown_x() || settings.shaper_unknown_y();
  facts.motor_max_velocity_mm_s = settings.motor_max_velocity_mm_s();
  facts.motor_max_accel_mm_s2 = settings.motor_max_accel_mm_s2();
  facts.motor_max_accel_origin = origin_of(settings, settings.motor_max_accel_key());
  facts.travel = travel_text(settings.printer);
  facts.lines_source = lines_source(settings.printer);
  facts.max_lines_per_s = settings.max_lines_per_s();
  return facts;
}

}  // namespace unflex::flow
