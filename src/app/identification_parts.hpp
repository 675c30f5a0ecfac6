// Parts that the text and the page of an identification share.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "identification.hpp"
#include "unflex/identify/axis_model.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::app {

// The estimate with the digits that its interval leaves certain.
[[nodiscard]] std::string estimate_text(const identify::Estimate& e);
// "44.9 to 45.9".
[[nodiscard]] std::string interval_text(const identify::Estimate& e);
// "45.4 Hz".
[[nodiscard]] std::string mode_name(const identify::ModeEstimate& mode);
// Where the sensor's own axes lie against the motion; empty where nothing tells.
[[nodiscard]] std::string sensor_text(const std::array<double, 3>& direction);

// The heights at which a curve is drawn. A spectrum holds energies, which span decades, so we draw
// their roots, the amplitudes. A curve that swings about 0 is drawn as it is.
[[nodiscard]] std::vector<double> heights(const identify::Curve& curve,
                                          const std::vector<double>& values);

// A curve of a record's picture.
struct Trace {
  std::string name;
  std::vector<double> values;
  std::string colour;
  report::Stroke stroke = report::Stroke::solid;
};

// Curves of the measurement and the model: the whole model, each mode alone, noise, and the
// residual.
[[nodiscard]] std::vector<Trace> traces_of(const IdentifiedRecord& record);

}  // namespace unflex::app
