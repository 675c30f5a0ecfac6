// The result of `unflex identify`, for people, for programs and as a page.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "unflex/identify/axis_model.hpp"
#include "unflex/identify/over_places.hpp"
#include "unflex/rivals/klipper_calibration.hpp"

namespace unflex::app {

struct IdentifiedRecord {
  std::string name;
  identify::Axis axis = identify::Axis::x;
  identify::RecordFit fit;
  std::optional<identify::Place> place_mm = {};  // that its name tells
  // The shaper that Klipper's calibration would set up for the record. Unset: the record is not the
  // spectrum of an axis.
  std::optional<rivals::FittedShaper> shaper;
};

struct Identification {
  std::vector<IdentifiedRecord> records;  // in the order of the command line
  // From all trusted records of an axis. An axis without one is missing.
  std::map<identify::Axis, identify::AxisModel> axes;
  // For an axis whose trusted records are of several places; its model is that in `axes`.
  std::map<identify::Axis, identify::AxisOverPlaces> over_places;
  std::vector<std::string> warnings;  // "file: warning: …"
  bool is_second = false;             // the modes lie behind those that are already compensated for
  std::vector<std::string> refusals;  // "file: …", of axes without a trusted record
};

// The lines to paste into a printer file.
[[nodiscard]] std::string snippet(const Identification& identification);

// The settings of the snippet as overrides: "key=value".
[[nodiscard]] std::vector<std::string> dynamics_overrides(const Identification& identification);

[[nodiscard]] std::string identification_text(const Identification& identification);

// The keys are those of docs/identify.md.
[[nodiscard]] std::string identification_json(const Identification& identification);
[[nodiscard]] std::string identification_html(const Identification& identification);

}  // namespace unflex::app
