#include "printer_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/machine/as_printer.hpp"
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

// Adds the axes of a machine with one tool. Each value is the tool's, whose keys begin so, or the
// printer's.
void add_axes(const machine::Settings& settings, const std::string& tool, std::string_view name,
              report::PrinterFacts& facts) {
  for_each_axis(
      [&](std::string_view letter, std::string_view key, const machine::AxisDynamics& axis) {
        std::string origin =
            tool.empty() ? std::string(machine::kDefaultOrigin)
                         : origin_of(settings, fmt::format("{}dynamics.{}.freq_hz", tool, key));
        if (origin == machine::kDefaultOrigin) {
          origin = origin_of_axis(settings, std::string(key));
        }
        facts.axes.push_back(
            {fmt::format("{}{}", name, letter), axis.description(), std::move(origin)});
      },
      kAxisLetters, kAxisKeys, settings.dynamics);
}

std::string travel_text(const machine::PrinterSettings& printer) {
  std::vector<std::string> ranges;
  for_each_axis(
      [&](std::string_view letter, const std::optional<machine::Range>& travel) {
        if (travel) {
          ranges.push_back(fmt::format("{} {:g} to {:g}", letter, travel->min, travel->max));
        }
      },
      kAxisLetters, printer.travel_mm);
  return ranges.size() == XY::kCount ? fmt::format("{} mm", fmt::join(ranges, ", ")) : "";
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
  shaper.freq_hz = rules.interpreter.shaper_freq_hz;
  planner::Shaping shaping = planner::shaping(rules.fixed, shaper);
  if (!shaping.acts()) {
    return std::nullopt;
  }
  const planner::InstalledShaper& installed = rules.fixed.shaper;
  std::string name = shaper_text(installed.type.x, shaper.freq_hz.x);
  if (const std::string y = shaper_text(installed.type.y, shaper.freq_hz.y); y != name) {
    const bool differs_in_hz_only =
        installed.type.x == installed.type.y &&
        all_axes([](const dynamics::ShaperPulses& pulses) { return !pulses.empty(); }, shaping);
    name += "/" + (differs_in_hz_only ? fmt::format("{:.4g}", shaper.freq_hz.y) : y);
  }
  return record::PrinterShaper{name + " Hz", std::move(shaping)};
}

report::PrinterFacts printer_facts(const machine::Settings& settings) {
  report::PrinterFacts facts;
  // A print begins with tool 0, so the printer's own axes count only if no such tool is told of.
  if (settings.tools.empty() || settings.tools.front().number != 0) {
    add_axes(settings, {}, "", facts);
  }
  for (const machine::ToolSettings& tool : settings.tools) {
    add_axes(machine::with_tool(settings, tool.number), fmt::format("tool.{}.", tool.number),
             fmt::format("T{} ", tool.number), facts);
  }
  if (const auto own = printer_shaper(run::verify_rules(settings))) {
    facts.shaper = own->name;
  }
  facts.shaper_unknown = any_axis(std::identity{}, settings.shaper_unknown());
  facts.motor_max_velocity_mm_s = settings.motor_max_velocity_mm_s();
  facts.motor_max_accel_mm_s2 = settings.motor_max_accel_mm_s2();
  facts.motor_max_accel_origin = origin_of(settings, settings.motor_max_accel_key());
  facts.travel = travel_text(settings.printer);
  facts.lines_source = lines_source(settings.printer);
  facts.max_lines_per_s = settings.max_lines_per_s();
  return facts;
}

}  // namespace unflex::flow
