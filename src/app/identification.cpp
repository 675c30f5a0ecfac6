#include "identification.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "identification_parts.hpp"
#include "identification_places.hpp"
#include "sparkline.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::app {
namespace {

using identify::AxisModel;
using identify::Curve;
using identify::Estimate;
using identify::ModeEstimate;
using identify::ModeOfAxis;
using report::Json;

// "45.4 Hz (44.9 to 45.9), ζ 0.071 (0.066 to 0.076)", and the gain where there are others.
std::string mode_text(const ModeEstimate& mode, bool is_alone) {
  std::string text =
      fmt::format("{} Hz ({}), ζ {} ({})", estimate_text(mode.freq_hz), interval_text(mode.freq_hz),
                  estimate_text(mode.damping_ratio), interval_text(mode.damping_ratio));
  if (!is_alone) {
    text += fmt::format(", gain {} ({})", estimate_text(mode.gain), interval_text(mode.gain));
  }
  return text;
}

std::string drawing(const IdentifiedRecord& record) {
  const Curve& curve = record.fit.curve;
  if (curve.x.empty()) {
    return {};
  }
  const std::vector<double> measured = heights(curve, curve.measured);
  const double least = curve.is_spectrum ? 0.0 : *std::ranges::min_element(measured);
  const double most = *std::ranges::max_element(measured);
  if (!(least < most)) {
    return {};
  }
  std::string text;
  for (const Trace& trace : traces_of(record)) {
    text += fmt::format("  {:<13}{}\n", trace.name,
                        sparkline(heights(curve, trace.values), least, most));
  }
  return text + fmt::format("  {:<13}{:.3g} to {:.3g} {}\n", "", curve.x.front(), curve.x.back(),
                            curve.is_spectrum ? "Hz" : "s");
}

std::string record_text(const IdentifiedRecord& record) {
  const std::vector<ModeEstimate>& modes = record.fit.model.modes;
  const std::string sensor = sensor_text(record.fit.direction);
  std::string text =
      fmt::format("{}: along {}{}{}, {}\n", record.name, letter(record.axis),
                  sensor.empty() ? "" : ", ", sensor, to_string(record.fit.model.method));
  if (!record.fit.is_trusted()) {
    text += "  no model of it is to be trusted\n";
  }
  for (const ModeEstimate& mode : modes) {
    text += record.fit.is_trusted() ? fmt::format("  {}\n", mode_text(mode, modes.size() == 1))
                                    : std::string{};
  }
  return text + drawing(record);
}

// "{freq_hz = 45.4, damping_ratio = 0.071, gain = 1}, …"
std::string list_text(const std::vector<ModeOfAxis>& modes, std::string_view between) {
  std::string text;
  for (const ModeOfAxis& mode : modes) {
    text += fmt::format("{}{{freq_hz = {:.2f}, damping_ratio = {:.4f}, gain = {:.4f}}}",
                        text.empty() ? "" : between, mode.freq_hz, mode.damping_ratio, mode.gain);
  }
  return text;
}

std::string plants_text(identify::Axis axis, const AxisModel& model) {
  std::string text;
  for (const identify::Plant& plant : other_plants(model)) {
    text += fmt::format("\n[[dynamics.{}.plant]]\nshare = {:.4f}\nmode = [{}]\n", letter(axis),
                        plant.share, list_text(plant.modes, ",\n        "));
  }
  return text.empty() ? text
                      : "\n# What the records leave open: the axis may be one of these, too.\n" +
                            text.substr(1);
}

// The places of an axis; none unless its records are of several.
const identify::AxisOverPlaces* places_of(const Identification& identification,
                                          identify::Axis axis) {
  const auto found = identification.over_places.find(axis);
  return found == identification.over_places.end() ? nullptr : &found->second;
}

// has_maps: the frequency is what shares are told of, so it is written as exactly as the maps.
std::string modes_text(identify::Axis axis, const AxisModel& model, bool has_maps) {
  const auto line = [](std::string_view key, const std::string& value, const Estimate& e) {
    return fmt::format("{} = {}  # 95 %: {}\n", key, value, interval_text(e));
  };
  std::string text;
  for (const ModeEstimate& mode : model.modes) {
    const bool is_alone = model.modes.size() == 1;
    text += fmt::format("{}{}\n", text.empty() ? "" : "\n",
                        is_alone ? fmt::format("[dynamics.{}]", letter(axis))
                                 : fmt::format("[[dynamics.{}.mode]]", letter(axis)));
    text += line("freq_hz",
                 has_maps ? fmt::format("{:.2f}", mode.freq_hz.value) : estimate_text(mode.freq_hz),
                 mode.freq_hz) +
            line("damping_ratio", estimate_text(mode.damping_ratio), mode.damping_ratio);
    if (!is_alone) {
      text += line("gain", fmt::format("{:.4f}", mode.gain.value), mode.gain);
    }
  }
  return text;
}

std::string second_text(const Identification& identification) {
  std::string text;
  for (const auto& [axis, model] : identification.axes) {
    const ModeEstimate& mode = model.modes.front();
    for (const auto& [key, e] :
         {std::pair("freq_hz", mode.freq_hz), std::pair("damping_ratio", mode.damping_ratio)}) {
      text += fmt::format("{}_{} = {}  # 95 %: {}\n", letter(axis), key, estimate_text(e),
                          interval_text(e));
    }
  }
  return text.empty() ? text : "[second]\n" + text;
}

Json model_json(const AxisModel& model) {
  Json json;
  json["method"] = to_string(model.method);
  json["modes"] = Json::array();
  for (const ModeEstimate& mode : model.modes) {
    json["modes"].push_back({{"freq_hz", estimate_json(mode.freq_hz)},
                             {"damping_ratio", estimate_json(mode.damping_ratio)},
                             {"gain", estimate_json(mode.gain)}});
  }
  json["covariance"] = model.covariance;
  json["plants"] = Json::array();
  for (const identify::Plant& plant : model.plants) {
    Json modes = Json::array();
    for (const ModeOfAxis& mode : plant.modes) {
      modes.push_back(
          {{"freq_hz", mode.freq_hz}, {"damping_ratio", mode.damping_ratio}, {"gain", mode.gain}});
    }
    json["plants"].push_back({{"share", plant.share}, {"modes", std::move(modes)}});
  }
  return json;
}

Json record_json(const IdentifiedRecord& record) {
  const identify::RecordFit& fit = record.fit;
  Json json = model_json(fit.model);
  json["name"] = record.name;
  json["axis"] = std::string(1, letter(record.axis));
  json["place_mm"] = record.place_mm ? Json(*record.place_mm) : Json(nullptr);
  json["refusal"] = fit.is_trusted() ? Json(nullptr) : Json(fit.refusal);
  json["direction"] = fit.direction;
  json["unexplained"] = fit.unexplained;
  json["bic"] = fit.bic;
  json["curve"] = {{fit.curve.is_spectrum ? "freq_hz" : "time_s", fit.curve.x},
                   {"measured", fit.curve.measured},
                   {"fitted", fit.curve.fitted},
                   {"modes", fit.curve.modes},
                   {"noise", fit.curve.noise}};
  return json;
}

}  // namespace

std::string snippet(const Identification& identification) {
  if (identification.is_second) {
    return second_text(identification);
  }
  std::string text;
  for (const auto& [axis, model] : identification.axes) {
    const identify::AxisOverPlaces* const places = places_of(identification, axis);
    const std::string maps = places != nullptr ? maps_text(axis, *places) : std::string{};
    text += (text.empty() ? "" : "\n") + modes_text(axis, model, !maps.empty()) + maps +
            plants_text(axis, model);
  }
  return text;
}

std::vector<std::string> dynamics_overrides(const Identification& identification) {
  std::vector<std::string> overrides;
  for (const auto& [axis, model] : identification.axes) {
    const std::string section = fmt::format("dynamics.{}", letter(axis));
    const std::vector<ModeOfAxis>& modes = model.values();
    if (modes.size() == 1) {
      overrides.push_back(fmt::format("{}.freq_hz={:.3f}", section, modes.front().freq_hz));
      overrides.push_back(
          fmt::format("{}.damping_ratio={:.4f}", section, modes.front().damping_ratio));
    } else {
      overrides.push_back(fmt::format("{}.mode=[{}]", section, list_text(modes, ", ")));
    }
    if (const auto* const places = places_of(identification, axis);
        places != nullptr && !places->maps.empty()) {
      overrides.push_back(fmt::format("{}.map={}", section, maps_value(*places)));
    }
    std::string plants;
    for (const identify::Plant& plant : other_plants(model)) {
      plants += fmt::format("{}{{share = {:.4f}, mode = [{}]}}", plants.empty() ? "" : ", ",
                            plant.share, list_text(plant.modes, ", "));
    }
    if (!plants.empty()) {
      overrides.push_back(fmt::format("{}.plant=[{}]", section, plants));
    }
  }
  return overrides;
}

std::string identification_text(const Identification& identification) {
  std::string text;
  for (const IdentifiedRecord& record : identification.records) {
    text += record_text(record) + "\n";
  }
  for (const auto& [axis, places] : identification.over_places) {
    text += places_text(axis, places) + "\n";
  }
  return text + snippet(identification);
}

std::string identification_json(const Identification& identification) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "identify";
  json["version"] = version();
  json["dynamics"] = Json::object();
  for (const auto& [axis, model] : identification.axes) {
    Json& of_axis = json["dynamics"][std::string(1, letter(axis))];
    of_axis = model_json(model);
    if (const auto* const places = places_of(identification, axis)) {
      add_places(*places, of_axis);
    }
  }
  json["records"] = Json::array();
  for (const IdentifiedRecord& record : identification.records) {
    json["records"].push_back(record_json(record));
  }
  json["snippet"] = snippet(identification);
  json["warnings"] = identification.warnings;
  return report::dump(json);
}

}  // namespace unflex::app
