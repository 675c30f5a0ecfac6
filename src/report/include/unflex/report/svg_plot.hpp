// Line plots as inline SVG for pages of html_page.hpp: colours are the page's CSS properties, so
// that a plot follows light and dark; curves differ in dashes as well as in colour.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace unflex::report {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

enum class Stroke { solid, dashed, dotted };

struct PlotCurve {
  std::string label;              // plain text, for the legend; empty: not in it
  std::string colour = "--text";  // a CSS property of the page
  Stroke stroke = Stroke::solid;
  double width_px = 1.5;
  std::vector<PlotPoint> points;  // a single one is drawn as a dot
};

struct PlotRange {
  double from = 0.0;
  double to = 1.0;
};

struct Plot {
  std::string title;  // plain text, spoken for the picture
  std::string x_label;
  std::string y_label;
  int width_px = 340;
  int height_px = 240;
  // The ranges that are shown. Unset: all curves, with some room.
  std::optional<PlotRange> x = std::nullopt;
  std::optional<PlotRange> y = std::nullopt;
  bool log_x = false;        // logarithmic in x, whose values and range are above 0
  bool equal_scale = false;  // one unit is as long in y as in x; widens the smaller range
  std::vector<PlotCurve> curves = {};
};

// <svg class="plot">. Points that do not move a curve by more than a fifth of a pixel are left out,
// as are those far outside what is shown.
[[nodiscard]] std::string svg_plot(const Plot& plot);

// The labelled curves of a plot as <div class="legend">.
[[nodiscard]] std::string svg_legend(const Plot& plot);

// The plot with its legend as the text of an SVG file, light or dark as the viewer's system.
[[nodiscard]] std::string svg_picture(const Plot& plot);

}  // namespace unflex::report
