#include "html_figures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "step.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::study {
namespace {

using report::Plot;
using report::PlotCurve;
using report::PlotPoint;
using report::Stroke;

// Half the width of the zoom, as a multiple of the error without compensation.
constexpr double kZoom = 1.3;
constexpr double kLeastZoom_mm = 1e-3;

// One line of the figures: what moves, and how it is drawn.
struct Track {
  std::string_view label;
  std::string_view colour;
  Stroke stroke;
  double width_px;
  const rivals::TimeGrid* grid;
  const std::vector<dynamics::NozzleMotionXY>* states;
};

std::vector<Track> tracks(const CaseResult& result, const MethodResult& method) {
  const MethodResult& plain = result.methods[static_cast<std::size_t>(Method::uncompensated)];
  std::vector<Track> list = {
      {"plan", "--muted", Stroke::dotted, 1.5, &plain.trace.grid, &plain.trace.base},
      {"nozzle, uncompensated", "--before", Stroke::dashed, 1.5, &plain.trace.grid,
       &plain.trace.nozzle}};
  if (method.method != Method::uncompensated) {
    list.push_back(
        {"base", "--series-3", Stroke::solid, 1.0, &method.trace.grid, &method.trace.base});
    list.push_back(
        {"nozzle", "--after", Stroke::solid, 2.0, &method.trace.grid, &method.trace.nozzle});
  }
  return list;
}

PlotCurve curve_of(const Track& track) {
  return {std::string(track.label), std::string(track.colour), track.stroke, track.width_px, {}};
}

Plot in_the_plane(const std::vector<Track>& list, std::string title) {
  Plot plot{.title = std::move(title), .x_label = "x, mm", .y_label = "y, mm", .equal_scale = true};
  for (const Track& track : list) {
    PlotCurve curve = curve_of(track);
    for (const dynamics::NozzleMotionXY& at : *track.states) {
      curve.points.push_back({at.x.position, at.y.position});
    }
    plot.curves.push_back(std::move(curve));
  }
  return plot;
}

// A quantity of both axes of every track over time, minus its value in `from`.
Plot over_time(const std::vector<Track>& list, double dynamics::NozzleMotion::*quantity,
               const dynamics::NozzleMotionXY& from, std::string title, std::string label) {
  Plot plot{.title = std::move(title), .x_label = "t, ms", .y_label = std::move(label)};
  for (const Track& track : list) {
    for (std::size_t axis = 0; axis < from.kCount; ++axis) {
      PlotCurve curve = curve_of(track);
      for (std::size_t k = 0; k < track.states->size(); ++k) {
        curve.points.push_back(
            {1e3 * track.grid->at(k), (*track.states)[k][axis].*quantity - from[axis].*quantity});
      }
      plot.curves.push_back(std::move(curve));
    }
  }
  return plot;
}

Plot error_over_time(const MethodResult& method, std::string title) {
  Plot plot{.title = std::move(title), .x_label = "t, ms", .y_label = "contour error, µm"};
  PlotCurve curve{"", "--after", Stroke::solid, 1.5, {}};
  for (std::size_t k = 0; k < method.trace.error_mm.size(); ++k) {
    curve.points.push_back({1e3 * method.trace.grid.at(k), 1e3 * method.trace.error_mm[k]});
  }
  plot.curves.push_back(std::move(curve));
  return plot;
}

std::string figure(std::string_view caption, const Plot& plot) {
  return fmt::format("<figure><figcaption>{}</figcaption>{}</figure>\n", caption,
                     report::svg_plot(plot));
}

// Every base is a thin staircase in the colour of its nozzle.
Plot step_plot(double zeta) {
  constexpr double kShown_s = 0.15;
  constexpr std::size_t kSamples = 300;
  struct Look {
    std::string_view colour;
    Stroke stroke;
  };
  constexpr std::array<Look, 4> kLooks = {{{"--before", Stroke::dashed},
                                           {"--series-3", Stroke::solid},
                                           {"--series-4", Stroke::dashed},
                                           {"--series-5", Stroke::solid}}};
  Plot plot{.title = fmt::format("Nozzle after a step of the base, ζ {}", zeta),
            .x_label = "t, ms",
            .y_label = "mm"};
  const std::vector<NamedStaircase> all = staircases(zeta);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string colour(kLooks[i].colour);
    PlotCurve nozzle{std::string(all[i].shaper), colour, kLooks[i].stroke, 2.0, {}};
    PlotCurve base{"", colour, Stroke::dotted, 1.0, {{0.0, 0.0}}};
    for (std::size_t k = 0; k <= kSamples; ++k) {
      const double t = kShown_s * static_cast<double>(k) / static_cast<double>(kSamples);
      nozzle.points.push_back({1e3 * t, all[i].staircase.nozzle(t).position});
      const double base_mm = all[i].staircase.base_mm(t);
      base.points.push_back({1e3 * t, base.points.back().y});
      base.points.push_back({1e3 * t, base_mm});
    }
    plot.curves.push_back(std::move(nozzle));
    plot.curves.push_back(std::move(base));
  }
  return plot;
}

}  // namespace

std::string step_figures() {
  std::string html = report::svg_legend(step_plot(kStepZetas.front())) + "<div class=\"plots\">\n";
  for (const double zeta : kStepZetas) {
    html += figure(fmt::format("ζ {}", zeta), step_plot(zeta));
  }
  return html + "</div>\n";
}

std::string figures(const CaseResult& result, const MethodResult& method) {
  const std::vector<Track> list = tracks(result, method);
  const std::string of = fmt::format("{}, case {}", name(method.method), result.name);
  const double half = std::max(
      kZoom * result.methods[static_cast<std::size_t>(Method::uncompensated)].straying[0].max_mm,
      kLeastZoom_mm);

  // Displacements are relative to the start of the plan.
  const dynamics::NozzleMotionXY& start = list.front().states->front();

  const Plot plane = in_the_plane(list, fmt::format("Path in the plane, {}", of));
  Plot corner = in_the_plane(list, fmt::format("Zoomed in, {}", of));
  const auto around = [&](double at_mm) { return report::PlotRange{at_mm - half, at_mm + half}; };
  corner.x = around(result.focus_mm.x);
  corner.y = around(result.focus_mm.y);
  std::string html = report::svg_legend(plane) + "<div class=\"plots\">\n";
  html += figure("Path in the plane", plane);
  html += figure("Zoomed in where it matters", corner);
  html += figure("Displacement, x then y",
                 over_time(list, &dynamics::NozzleMotion::position, start,
                           fmt::format("Displacement over time, {}", of), "mm"));
  html +=
      figure("Velocity, x then y", over_time(list, &dynamics::NozzleMotion::velocity, {},
                                             fmt::format("Velocity over time, {}", of), "mm/s"));
  html += figure("Distance of the nozzle from the path",
                 error_over_time(method, fmt::format("Contour error over time, {}", of)));
  return html + "</div>\n";
}

}  // namespace unflex::study
