// What an identification tells of the places of its records.
#pragma once

#include <string>

#include "unflex/identify/over_places.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::app {

// The tables [[dynamics.x.map]] for a printer file; empty without maps.
[[nodiscard]] std::string maps_text(identify::Axis axis, const identify::AxisOverPlaces& all);
// The maps as the value of an override of dynamics.x.map: a list of inline tables.
[[nodiscard]] std::string maps_value(const identify::AxisOverPlaces& all);

// A table of the places: what was measured, and what the maps say there.
[[nodiscard]] std::string places_text(identify::Axis axis, const identify::AxisOverPlaces& all);
[[nodiscard]] std::string places_html(identify::Axis axis, const identify::AxisOverPlaces& all);

// Adds maps, places and remark to the JSON of the axis.
void add_places(const identify::AxisOverPlaces& all, report::Json& axis);

[[nodiscard]] report::Json estimate_json(const identify::Estimate& e);

}  // namespace unflex::app
