#include "unflex/report/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

#include "assets.hpp"
#include "unflex/core/math.hpp"
#include "unflex/report/html_page.hpp"

namespace unflex::report {
namespace {

using Sink = std::back_insert_iterator<std::string>;

constexpr double kLeft = 52.0;
constexpr double kRight = 10.0;
constexpr double kTop = 8.0;
constexpr double kBottom = 36.0;
constexpr double kTolerancePx = 0.2;
constexpr double kRoom = 0.05;
// Points further outside than this multiple of the plot's size are moved nearer.
constexpr double kBeyond = 4.0;

PlotRange range_of(const Plot& plot, double PlotPoint::*coordinate) {
  PlotRange range{std::numeric_limits<double>::infinity(),
                  -std::numeric_limits<double>::infinity()};
  for (const PlotCurve& curve : plot.curves) {
    for (const PlotPoint& point : curve.points) {
      range.from = std::min(range.from, point.*coordinate);
      range.to = std::max(range.to, point.*coordinate);
    }
  }
  if (!(range.to > range.from)) {
    const double middle = std::isfinite(range.from) ? range.from : 0.0;
    return {middle - 0.5, middle + 0.5};
  }
  const double room = kRoom * (range.to - range.from);
  return {range.from - room, range.to + room};
}

void widen(PlotRange& range, double size) {
  const double middle = 0.5 * (range.from + range.to);
  range = {middle - 0.5 * size, middle + 0.5 * size};
}

// Converts from the plot's units to pixels.
class Frame {
 public:
  explicit Frame(const Plot& plot)
      : x_(plot.x.value_or(range_of(plot, &PlotPoint::x))),
        y_(plot.y.value_or(range_of(plot, &PlotPoint::y))),
        width_(plot.width_px - kLeft - kRight),
        height_(plot.height_px - kTop - kBottom) {
    if (plot.equal_scale) {
      const double unit = std::max((x_.to - x_.from) / width_, (y_.to - y_.from) / height_);
      widen(x_, unit * width_);
      widen(y_, unit * height_);
    }
  }

  [[nodiscard]] double x(double value) const {
    return kLeft + width_ * (value - x_.from) / (x_.to - x_.from);
  }
  [[nodiscard]] double y(double value) const {
    return kTop + height_ * (y_.to - value) / (y_.to - y_.from);
  }
  [[nodiscard]] PlotPoint pixel(const PlotPoint& point) const {
    return {std::clamp(x(point.x), -kBeyond * width_, (1.0 + kBeyond) * width_),
            std::clamp(y(point.y), -kBeyond * height_, (1.0 + kBeyond) * height_)};
  }
  [[nodiscard]] const PlotRange& x_range() const { return x_; }
  [[nodiscard]] const PlotRange& y_range() const { return y_; }
  [[nodiscard]] double width() const { return width_; }
  [[nodiscard]] double height() const { return height_; }

 private:
  PlotRange x_;
  PlotRange y_;
  double width_;
  double height_;
};

double distance(const PlotPoint& p, const PlotPoint& a, const PlotPoint& b) {
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double square = dx * dx + dy * dy;
  const double along =
      square > 0.0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / square, 0.0, 1.0) : 0.0;
  return math::hypot(p.x - a.x - along * dx, p.y - a.y - along * dy);
}

// D. H. Douglas & T. K. Peucker, "Algorithms for the reduction of the number of points required to
// represent a digitized line or its caricature", Cartographica 10 (1973) 112–122.
std::vector<PlotPoint> simplified(const std::vector<PlotPoint>& points) {
  if (points.size() < 3) {
    return points;
  }
  std::vector<bool> kept(points.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open = {{0, points.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    double worst = kTolerancePx;
    std::size_t at = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double d = distance(points[i], points[first], points[last]);
      if (d > worst) {
        worst = d;
        at = i;
      }
    }
    if (at != 0) {
      kept[at] = true;
      open.emplace_back(first, at);
      open.emplace_back(at, last);
    }
  }
  std::vector<PlotPoint> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (kept[i]) {
      result.push_back(points[i]);
    }
  }
  return result;
}

// 1, 2 or 5 times a power of ten, so that about `wanted` of them fill the range.
double tick_step(const PlotRange& range, double wanted) {
  const double rough = (range.to - range.from) / wanted;
  const double power = math::pow(10.0, std::floor(math::log10(rough)));
  double nearest = power;
  for (const double multiple : {2.0, 5.0, 10.0}) {
    // Compare ratios: the border between two steps is their geometric mean.
    if (rough * rough > nearest * multiple * power) {
      nearest = multiple * power;
    }
  }
  return nearest;
}

struct Tick {
  double at = 0.0;
  std::string text;
};

std::vector<Tick> linear_ticks(const PlotRange& range, double wanted) {
  const double step = tick_step(range, wanted);
  // As many decimals as the step between ticks needs.
  const int decimals = std::max(0, -static_cast<int>(std::floor(math::log10(step) + 1e-9)));
  std::vector<Tick> result;
  for (double number = std::ceil(range.from / step - 1e-9); number * step <= range.to + 1e-9 * step;
       number += 1.0) {
    std::string text = fmt::format("{:.{}f}", number * step + 0.0, decimals);
    if (text.starts_with('-')) {
      text.replace(0, 1, "−");
    }
    result.push_back({number * step + 0.0, std::move(text)});
  }
  return result;
}

// 1, 2 and 5 times the powers of ten whose logarithms are in the range.
std::vector<Tick> logarithmic_ticks(const PlotRange& range) {
  std::vector<Tick> result;
  for (double power = std::floor(range.from); power <= range.to; power += 1.0) {
    for (const double multiple : {1.0, 2.0, 5.0}) {
      const double at = power + math::log10(multiple);
      if (at >= range.from && at <= range.to) {
        result.push_back({at, fmt::format("{:g}", multiple * math::pow(10.0, power))});
      }
    }
  }
  return result;
}

// The plot with logarithms for x.
Plot in_logarithms(Plot plot) {
  if (plot.x) {
    plot.x = PlotRange{math::log10(plot.x->from), math::log10(plot.x->to)};
  }
  for (PlotCurve& curve : plot.curves) {
    for (PlotPoint& point : curve.points) {
      point.x = math::log10(point.x);
    }
  }
  return plot;
}

constexpr double kTicksX = 5.5;
constexpr double kTicksY = 5.0;

void write_axes(Sink out, const Plot& plot, const Frame& frame) {
  const double bottom = kTop + frame.height();
  const double right = kLeft + frame.width();
  std::string grid;
  for (const Tick& tick :
       plot.log_x ? logarithmic_ticks(frame.x_range()) : linear_ticks(frame.x_range(), kTicksX)) {
    fmt::format_to(std::back_inserter(grid), "M{:.1f} {:.1f}V{:.1f}", frame.x(tick.at), kTop,
                   bottom);
    fmt::format_to(out, R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)",
                   frame.x(tick.at), bottom + 15.0, tick.text);
  }
  for (const Tick& tick : linear_ticks(frame.y_range(), kTicksY)) {
    fmt::format_to(std::back_inserter(grid), "M{:.1f} {:.1f}H{:.1f}", kLeft, frame.y(tick.at),
                   right);
    fmt::format_to(out, R"(<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>)", kLeft - 5.0,
                   frame.y(tick.at) + 4.0, tick.text);
  }
  fmt::format_to(out, R"x(<path d="{}" stroke="var(--line)" fill="none"/>)x", grid);
  fmt::format_to(out, R"(<text x="{:.1f}" y="{}" text-anchor="middle">{}</text>)",
                 kLeft + 0.5 * frame.width(), plot.height_px - 4, escape_html(plot.x_label));
  fmt::format_to(out,
                 R"x(<text transform="translate(11 {:.1f}) rotate(-90)" )x"
                 R"(text-anchor="middle">{}</text>)",
                 kTop + 0.5 * frame.height(), escape_html(plot.y_label));
}

std::string_view dashes(Stroke stroke) {
  switch (stroke) {
    case Stroke::dashed:
      return R"( stroke-dasharray="6 3")";
    case Stroke::dotted:
      return R"( stroke-dasharray="1.5 3")";
    case Stroke::solid:
      break;
  }
  return {};
}

void write_curve(Sink out, const PlotCurve& curve, const Frame& frame) {
  std::vector<PlotPoint> pixels;
  pixels.reserve(curve.points.size());
  for (const PlotPoint& point : curve.points) {
    pixels.push_back(frame.pixel(point));
  }
  if (pixels.size() == 1) {
    fmt::format_to(out, R"x(<circle cx="{:.1f}" cy="{:.1f}" r="4" fill="var({})"/>)x", pixels[0].x,
                   pixels[0].y, curve.colour);
    return;
  }
  std::string path;
  for (const PlotPoint& point : simplified(pixels)) {
    fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', point.x,
                   point.y);
  }
  fmt::format_to(out,
                 R"x(<path d="{}" stroke="var({})" stroke-width="{}"{} fill="none" )x"
                 R"(stroke-linejoin="round"/>)",
                 path, curve.colour, curve.width_px, dashes(curve.stroke));
}

// Axes and curves. An inner viewport clips them, since a clip path would need an identifier that is
// unique in the page.
void write_plot(Sink out, const Plot& asked) {
  const Plot plot = asked.log_x ? in_logarithms(asked) : asked;
  const Frame frame(plot);
  write_axes(out, plot, frame);
  fmt::format_to(out,
                 R"(<svg x="{0}" y="{1}" width="{2:.1f}" height="{3:.1f}" )"
                 R"(viewBox="{0} {1} {2:.1f} {3:.1f}">)",
                 kLeft, kTop, frame.width(), frame.height());
  for (const PlotCurve& curve : plot.curves) {
    write_curve(out, curve, frame);
  }
  fmt::format_to(out, "</svg>");
}

}  // namespace

std::string svg_plot(const Plot& plot) {
  std::string svg;
  const Sink out = std::back_inserter(svg);
  fmt::format_to(out, R"(<svg class="plot" viewBox="0 0 {} {}" role="img" aria-label="{}">)",
                 plot.width_px, plot.height_px, escape_html(plot.title));
  write_plot(out, plot);
  fmt::format_to(out, "</svg>\n");
  return svg;
}

std::string svg_picture(const Plot& plot) {
  constexpr int kRow_px = 20;
  constexpr int kColumns = 3;
  const auto labelled = [](const PlotCurve& curve) { return !curve.label.empty(); };
  const auto labels = static_cast<int>(std::ranges::count_if(plot.curves, labelled));
  const int legend_px = 8 + kRow_px * ((labels + kColumns - 1) / kColumns);
  std::string svg;
  const Sink out = std::back_inserter(svg);
  fmt::format_to(out,
                 R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" width="{0}" )"
                 R"(height="{1}" font-family="system-ui, sans-serif" font-size="12">)"
                 "\n<title>{2}</title>\n<style>\n{3}text {{ fill: var(--muted); }}\n</style>\n"
                 R"x(<rect width="{0}" height="{1}" rx="6" fill="var(--surface)"/>)x",
                 plot.width_px, plot.height_px + legend_px, escape_html(plot.title),
                 assets::colours_css);
  int number = 0;
  for (const PlotCurve& curve : plot.curves) {
    if (labelled(curve)) {
      const int x = static_cast<int>(kLeft) +
                    (plot.width_px - static_cast<int>(kLeft)) * (number % kColumns) / kColumns;
      const int y = kRow_px / 2 + 4 + kRow_px * (number / kColumns);
      fmt::format_to(out,
                     R"x(<path d="M{} {}h26" stroke="var({})" stroke-width="{}"{}/>)x"
                     R"(<text x="{}" y="{}">{}</text>)",
                     x, y, curve.colour, curve.width_px, dashes(curve.stroke), x + 32, y + 4,
                     escape_html(curve.label));
      ++number;
    }
  }
  fmt::format_to(out, R"x(<g transform="translate(0 {})">)x", legend_px);
  write_plot(out, plot);
  fmt::format_to(out, "</g>\n</svg>\n");
  return svg;
}

std::string svg_legend(const Plot& plot) {
  std::string html = R"(<div class="legend">)";
  for (const PlotCurve& curve : plot.curves) {
    if (!curve.label.empty()) {
      fmt::format_to(std::back_inserter(html),
                     R"(<span><svg width="26" height="10" aria-hidden="true"><path d="M0 5H26" )"
                     R"x(stroke="var({})" stroke-width="{}"{}/></svg> {}</span>)x",
                     curve.colour, curve.width_px, dashes(curve.stroke), escape_html(curve.label));
    }
  }
  return html + "</div>\n";
}

}  // namespace unflex::report
