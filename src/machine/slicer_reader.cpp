#include "slicer_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>

#include "text_lines.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/command.hpp"
#include "variants.hpp"

namespace unflex::machine {
namespace {

struct SlicerOption {
  std::string text;
  SourcePlace place;
};

using Options = std::map<std::string, SlicerOption>;

struct Flavor {
  std::string_view name;  // gcode_flavor, and Cura's FLAVOR, in lower case
  Firmware firmware;
};

// Creality OS is Creality's build of Klipper.
constexpr std::array kFlavors = {Flavor{"klipper", Firmware::klipper},
                                 Flavor{"creality os", Firmware::klipper},
                                 Flavor{"marlin", Firmware::marlin},
                                 Flavor{"marlin2", Firmware::marlin},
                                 Flavor{"marlinfirmware", Firmware::marlin},
                                 Flavor{"marlin(volumetric)", Firmware::marlin},
                                 Flavor{"reprapfirmware", Firmware::rrf},
                                 Flavor{"reprap (reprap)", Firmware::rrf},
                                 Flavor{"rrf", Firmware::rrf}};

// "; key = value", as all of Slic3r's family write.
void look_for_option(std::string_view line, const SourcePlace& place, Options& options) {
  if (!line.starts_with("; ")) {
    return;
  }
  const std::size_t equals = line.find(" = ");
  const std::string_view key = line.substr(2, equals - std::min<std::size_t>(equals, 2));
  const bool is_key =
      equals != std::string_view::npos && !key.empty() &&
      key.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string_view::npos;
  if (is_key) {
    options[std::string(key)] = {std::string(trimmed(line.substr(equals + 3))), place};
  }
}

// "SLIC3R_NOZZLE_DIAMETER" is the option nozzle_diameter.
std::string option_of(std::string_view variable) {
  return lower(variable.substr(variable.find('_') + 1));
}

// The first line with a command of Klipper's own or a macro, 0 if there is none: other firmwares
// have no commands of that form.
std::size_t klipper_line(std::string_view head) {
  std::size_t first = 0;
  for_each_line(head, 1, [&](std::string_view line, std::size_t number) {
    if (first == 0 && gcode::parse(line).kind == gcode::CommandKind::extended) {
      first = number;
    }
  });
  return first;
}

class Reader {
 public:
  explicit Reader(const PrintText& print) : print_(&print) {
    for (const auto& [name, value] : print.variables) {
      options_[option_of(name)] = {std::string(trimmed(value)), {name, 0}};
    }
    const auto look = [&](std::string_view line, std::size_t number) {
      constexpr std::string_view kCuraFlavor = ";FLAVOR:";
      const SourcePlace place{print.name, number};
      look_for_option(line, place, options_);
      if (line.starts_with(kCuraFlavor)) {
        options_["gcode_flavor"] = {std::string(trimmed(line.substr(kCuraFlavor.size()))), place};
      }
    };
    for_each_line(print.head, 1, look);
    for_each_line(print.tail, print.tail_line, look);
  }

  Reading read(std::optional<Firmware> runs, bool by_default) {
    diameter("nozzle_diameter", "extruder.nozzle_diameter_mm");
    diameter("filament_diameter", "extruder.filament_diameter_mm");
    const SlicerOption* const model = option("printer_model");
    recognise_print(*print_, model == nullptr ? "" : model->text,
                    model == nullptr ? SourcePlace{} : model->place,
                    by_default ? std::nullopt : runs, reading_);
    const std::optional<Firmware> named = flavor(by_default);
    if (!named) {
      return std::move(reading_);
    }
    const std::size_t macro =
        spec_of(*named).printers.names_klipper_too ? klipper_line(print_->head) : 0;
    const Firmware meant = macro != 0 ? Firmware::klipper : *named;
    const SourcePlace place = option("gcode_flavor")->place;
    if (!runs) {
      reading_.add("printer.firmware", std::string(to_string(meant)),
                   macro != 0 ? SourcePlace{print_->name, macro} : place);
    } else if (by_default && meant != *runs) {
      reading_.guess(place,
                     fmt::format("sliced for {0}, but taken to be run by {1}, the default, a guess "
                                 "that compensate refuses; say which it is with --set "
                                 "printer.firmware={0} or {1}, or by printer.firmware in the "
                                 "printer file",
                                 to_string(meant), to_string(*runs)));
    }
    const Firmware firmware = runs.value_or(meant);
    const SlicerOption* const usage = option("machine_limits_usage");
    if ((!runs || *named == firmware) && (usage == nullptr || usage->text != "ignore")) {
      spec_of(firmware).motion.has_axis_limits ? axis_limits(firmware) : klipper_limits();
    }
    return std::move(reading_);
  }

 private:
  [[nodiscard]] const SlicerOption* option(const std::string& name) const {
    const auto found = options_.find(name);
    return found == options_.end() ? nullptr : &found->second;
  }

  // The first of an option's values (the first extruder's, the normal mode's) if it is above 0.
  [[nodiscard]] std::optional<double> number(const std::string& name) const {
    const SlicerOption* const found = option(name);
    if (found == nullptr) {
      return std::nullopt;
    }
    const std::optional<double> value =
        parse_number(trimmed(std::string_view(found->text).substr(0, found->text.find(','))));
    return value && *value > 0.0 ? value : std::nullopt;
  }

  void add(const std::string& key, std::optional<double> value, const std::string& from) {
    if (value) {
      reading_.add(key, *value, option(from)->place);
    }
  }

  void diameter(const std::string& name, const std::string& key) { add(key, number(name), name); }

  std::optional<Firmware> flavor(bool by_default) {
    const SlicerOption* const given = option("gcode_flavor");
    if (given == nullptr) {
      return std::nullopt;
    }
    const auto known = std::ranges::find(kFlavors, lower(given->text), &Flavor::name);
    if (known != kFlavors.end()) {
      return known->firmware;
    }
    if (by_default) {
      reading_.guess(given->place,
                     fmt::format("unflex does not know G-code of the flavor '{}', and that klipper "
                                 "runs it is a guess that compensate refuses; say what runs it "
                                 "with --set printer.firmware=...",
                                 given->text));
    }
    return std::nullopt;
  }

  // OrcaSlicer and Bambu Studio speak of speeds, the others of feed rates.
  [[nodiscard]] std::string velocity_option(std::string_view axis) const {
    std::string speed = fmt::format("machine_max_speed_{}", axis);
    return option(speed) != nullptr ? speed : fmt::format("machine_max_feedrate_{}", axis);
  }

  // Adds the least or the greatest value of some options, with its place.
  template <class Better>
  void add_extreme(const std::string& key, const std::vector<std::string>& names, Better better) {
    std::string best;
    for (const std::string& name : names) {
      if (number(name) && (best.empty() || better(*number(name), *number(best)))) {
        best = name;
      }
    }
    if (!best.empty()) {
      add(key, number(best), best);
    }
  }

  void add_least(const std::string& key, const std::vector<std::string>& names) {
    add_extreme(key, names, std::less<>());
  }

  // Klipper's limits are for the tool's path; M204 and its like start from them.
  void klipper_limits() {
    const std::vector<std::string> velocities = {velocity_option("x"), velocity_option("y")};
    const std::vector<std::string> accels = {"machine_max_acceleration_x",
                                             "machine_max_acceleration_y",
                                             "machine_max_acceleration_extruding"};
    const auto and_z = [](std::vector<std::string> names, std::string z) {
      names.push_back(std::move(z));
      return names;
    };
    add_least("limits.max_velocity_mm_s", velocities);
    add_least("limits.max_accel_mm_s2", accels);
    if (number(velocity_option("z"))) {
      add_least("limits.max_z_velocity_mm_s", and_z(velocities, velocity_option("z")));
    }
    if (number("machine_max_acceleration_z")) {
      add_least("limits.max_z_accel_mm_s2", and_z(accels, "machine_max_acceleration_z"));
    }
  }

  void axis_limits(Firmware firmware) {
    for (const std::string axis : {"x", "y", "z", "e"}) {
      const std::string accel = "machine_max_acceleration_" + axis;
      const std::string jerk = "machine_max_jerk_" + axis;
      add("limits.max_" + axis + "_velocity_mm_s", number(velocity_option(axis)),
          velocity_option(axis));
      add("limits.max_" + axis + "_accel_mm_s2", number(accel), accel);
      add("limits.jerk_" + axis + "_mm_s", number(jerk), jerk);
    }
    // The motors' limits follow from these: velocity enough for the faster axis, acceleration not
    // too much for the weaker.
    add_extreme("limits.max_velocity_mm_s", {velocity_option("x"), velocity_option("y")},
                std::greater<>());
    add_least("limits.max_accel_mm_s2",
              {"machine_max_acceleration_x", "machine_max_acceleration_y"});
    const std::string print = "machine_max_acceleration_extruding";
    const std::string travel = "machine_max_acceleration_travel";
    add("limits.print_accel_mm_s2", number(print), print);
    add("limits.travel_accel_mm_s2", number(travel), travel);
    if (spec_of(firmware).printers.has_retract_accel) {
      const std::string retract = "machine_max_acceleration_retracting";
      add("limits.retract_accel_mm_s2", number(retract), retract);
      junctions();
    }
  }

  // The flavor "marlin" means Marlin 1, which for a long time knew only jerk.
  void junctions() {
    const std::string deviation = "machine_max_junction_deviation";
    if (number(deviation)) {
      add("limits.junction_deviation_mm", number(deviation), deviation);
      reading_.add("printer.classic_jerk", false, option(deviation)->place);
    } else if (option("gcode_flavor")->text == "marlin" && number("machine_max_jerk_x")) {
      reading_.add("printer.classic_jerk", true, option("gcode_flavor")->place);
    }
  }

  const PrintText* print_;
  Options options_;
  Reading reading_;
};

}  // namespace

Reading read_slicer(const PrintText& print, std::optional<Firmware> runs, bool by_default) {
  return Reader(print).read(runs, by_default);
}

std::string_view slicer_with_late_settings(const PrintText& print) {
  constexpr std::array<std::string_view, 4> kNames = {"PrusaSlicer", "SuperSlicer", "Slic3r",
                                                      "OrcaSlicer"};
  std::string_view late;
  bool has_settings = false;
  for_each_line(print.head, 1, [&](std::string_view line, std::size_t) {
    has_settings = has_settings || line.starts_with("; gcode_flavor = ");
    for (const std::string_view name : kNames) {
      if (late.empty() && line.starts_with(';') && line.find(name) != std::string_view::npos) {
        late = name;
      }
    }
  });
  return print.is_stream && !has_settings ? late : std::string_view{};
}

}  // namespace unflex::machine
