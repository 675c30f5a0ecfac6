#include "unflex/report/svg_plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

namespace unflex::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

PlotCurve sine(int points) {
  PlotCurve curve{"sine", "--after", Stroke::dashed, 2.0, {}};
  for (int i = 0; i < points; ++i) {
    const double t = 10.0 * i / (points - 1);
    curve.points.push_back({t, std::sin(t)});
  }
  return curve;
}

Plot plot_of(PlotCurve curve) {
  Plot plot{.title = "A <plot>", .x_label = "t & more", .y_label = "y"};
  plot.curves.push_back(std::move(curve));
  return plot;
}

std::size_t points_in(const std::string& svg) {
  // The curve is the path whose colour is not that of the grid.
  const std::regex path(R"re(<path d="([^"]*)" stroke="var\(--after\))re");
  std::smatch match;
  EXPECT_TRUE(std::regex_search(svg, match, path));
  const std::string d = match[1];
  return 1 + static_cast<std::size_t>(std::count(d.begin(), d.end(), 'L'));
}

TEST(SvgPlot, IsSpokenAndLabelledWithEscapedText) {
  const std::string svg = svg_plot(plot_of(sine(50)));
  EXPECT_THAT(svg, HasSubstr("role=\"img\" aria-label=\"A &lt;plot&gt;\""));
  EXPECT_THAT(svg, HasSubstr(">t &amp; more</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("<plot>")));
}

TEST(SvgPlot, TakesItsColoursFromThePage) {
  const std::string svg = svg_plot(plot_of(sine(50)));
  EXPECT_THAT(svg, HasSubstr("stroke=\"var(--after)\" stroke-width=\"2\" stroke-dasharray="));
  EXPECT_THAT(svg, Not(HasSubstr("#")));
}

TEST(SvgPlot, MayBeLogarithmicInX) {
  PlotCurve line{"", "--after", Stroke::solid, 1.0, {{5.0, 0.0}, {50.0, 1.0}, {500.0, 2.0}}};
  Plot plot = plot_of(line);
  plot.log_x = true;
  plot.x = PlotRange{5.0, 500.0};
  const std::string svg = svg_plot(plot);
  for (const char* tick : {">5<", ">10<", ">20<", ">50<", ">100<", ">200<", ">500<"}) {
    EXPECT_THAT(svg, HasSubstr(tick));
  }
  EXPECT_THAT(svg, Not(HasSubstr(">150<")));
  // Equal ratios are equal distances, so the middle point is on the line and left out.
  EXPECT_EQ(points_in(svg), 2U);
}

TEST(SvgPicture, BringsItsColoursAndItsLegend) {
  const std::string svg = svg_picture(plot_of(sine(50)));
  EXPECT_THAT(svg, ::testing::StartsWith("<svg xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(svg, HasSubstr("<title>A &lt;plot&gt;</title>"));
  EXPECT_THAT(svg, HasSubstr("prefers-color-scheme: dark"));
  EXPECT_THAT(svg, HasSubstr("--after: #"));
  EXPECT_THAT(svg, HasSubstr(">sine</text>"));
  const std::string plot = svg_plot(plot_of(sine(50)));
  const std::size_t inside = plot.find('>') + 1;
  EXPECT_THAT(svg, HasSubstr(plot.substr(inside, plot.rfind("</svg>") - inside)));
}

TEST(SvgPlot, LeavesOutPointsThatNobodyCouldSee) {
  const std::size_t few = points_in(svg_plot(plot_of(sine(20000))));
  EXPECT_LT(few, 120U);
  EXPECT_GT(few, 20U);
  PlotCurve line{"", "--after", Stroke::solid, 1.0, {}};
  for (int i = 0; i <= 1000; ++i) {
    line.points.push_back({i * 0.1, i * 0.2});
  }
  EXPECT_EQ(points_in(svg_plot(plot_of(line))), 2U);
}

TEST(SvgPlot, HasRoundTicks) {
  PlotCurve line{"", "--after", Stroke::solid, 1.0, {{0.0, -0.03}, {300.0, 0.05}}};
  const std::string svg = svg_plot(plot_of(line));
  for (const char* tick : {">0<", ">100<", ">200<", ">300<", ">−0.02<", ">0.00<", ">0.04<"}) {
    EXPECT_THAT(svg, HasSubstr(tick));
  }
}

TEST(SvgPlot, ShowsAUnitAlikeInBothDirectionsIfAsked) {
  PlotCurve line{"", "--after", Stroke::solid, 1.0, {{0.0, 0.0}, {10.0, 10.0}}};
  Plot plot = plot_of(line);
  plot.equal_scale = true;
  const std::string svg = svg_plot(plot);
  const std::regex path(
      R"re(<path d="M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)" stroke="var\(--after)re");
  std::smatch m;
  ASSERT_TRUE(std::regex_search(svg, m, path));
  EXPECT_NEAR(std::stod(m[3]) - std::stod(m[1]), std::stod(m[2]) - std::stod(m[4]), 0.2);
}

TEST(SvgPlot, OfNothingOrOfOnePointIsStillAPlot) {
  EXPECT_THAT(svg_plot({}), HasSubstr("</svg>"));
  EXPECT_THAT(svg_plot({}), Not(HasSubstr("nan")));
  PlotCurve point{"", "--after", Stroke::solid, 1.0, {{3.0, 4.0}}};
  EXPECT_THAT(svg_plot(plot_of(point)), Not(HasSubstr("nan")));
}

TEST(SvgLegend, NamesTheCurvesThatHaveANameAndShowsTheirStroke) {
  Plot plot = plot_of(sine(3));
  plot.curves.push_back({"", "--before", Stroke::solid, 1.0, {}});
  const std::string legend = svg_legend(plot);
  EXPECT_THAT(legend, HasSubstr("sine</span>"));
  EXPECT_THAT(legend, HasSubstr("stroke-dasharray"));
  EXPECT_THAT(legend, Not(HasSubstr("--before")));
}

TEST(SvgPlot, DrawsASinglePointAsADot) {
  Plot plot;
  plot.curves.emplace_back().points = {{20.0, 5.0}};
  const std::string svg = svg_plot(plot);
  EXPECT_NE(svg.find("<circle cx=\""), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace unflex::report
