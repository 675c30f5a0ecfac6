// How fast a print may go: the page and its picture.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <string_view>

#include "assets.hpp"
#include "fastest_words.hpp"
#include "report_parts.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/svg_plot.hpp"
#include "unflex/study/fastest.hpp"

namespace unflex::study {
namespace {

using report::escape_html;
using report::micrometres_text;
using report::Stroke;
using Sink = std::back_insert_iterator<std::string>;

// The look of a contender, by its place among them. unflex looks as "after" does elsewhere.
struct Look {
  std::string_view colour;
  Stroke stroke;
};
constexpr std::array kRivalLooks = {
    Look{"--series-2", Stroke::dotted}, Look{"--series-3", Stroke::dashed},
    Look{"--series-4", Stroke::solid}, Look{"--series-5", Stroke::dashed}};

report::Plot plot_of(const FastestOutcome& outcome) {
  report::Plot plot{.title = "Print time against tolerance, " + outcome.input,
                    .x_label = "tolerance, µm",
                    .y_label = "print time, s",
                    .width_px = 640,
                    .height_px = 340,
                    .log_x = true};
  const auto [least, most] = std::ranges::minmax(outcome.tolerances_mm);
  // A single tolerance has no width of its own.
  constexpr double kRoom = 1.1;
  plot.x = report::PlotRange{1e3 * least / kRoom, 1e3 * most * kRoom};
  double longest_s = outcome.at_feed_s;
  for (std::size_t c = 0; c < outcome.contenders.size(); ++c) {
    const FastestOfContender& contender = outcome.contenders[c];
    const bool is_unflex = contender.name == kUnflex;
    const Look look =
        is_unflex ? Look{"--after", Stroke::solid} : kRivalLooks[c % kRivalLooks.size()];
    report::PlotCurve curve{
        contender.name, std::string(look.colour), look.stroke, is_unflex ? 3.0 : 2.0, {}};
    for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
      if (contender.at[i]) {
        curve.points.push_back({1e3 * outcome.tolerances_mm[i], contender.at[i]->time_s});
        longest_s = std::max(longest_s, contender.at[i]->time_s);
      }
    }
    std::ranges::sort(curve.points, {}, &report::PlotPoint::x);
    plot.curves.push_back(std::move(curve));
  }
  plot.curves.push_back({"length / F",
                         "--muted",
                         Stroke::dashed,
                         1.5,
                         {{plot.x->from, outcome.at_feed_s}, {plot.x->to, outcome.at_feed_s}}});
  plot.y = report::PlotRange{0.0, 1.05 * longest_s};
  return plot;
}

void write_lead(Sink out, const FastestOutcome& outcome) {
  fmt::format_to(out,
                 "<section class=\"card\"><p class=\"lead\">The least time in which the print "
                 "keeps a tolerance, with input shapers and with unflex. As sliced it takes "
                 "<b>{}</b>&nbsp;s and the nozzle strays up to <b>{}</b>&nbsp;µm.</p>\n"
                 "<p class=\"note\">{}; {}. A tolerance is kept if the contour error is within it "
                 "{}.</p></section>\n",
                 time_text(outcome.as_sliced.time_s),
                 micrometres_text(outcome.as_sliced.errors.max_mm),
                 escape_html(outcome.description), escape_html(tuning_text(outcome)),
                 escape_html(rule_text(outcome.rule)));
}

void write_times(Sink out, const FastestOutcome& outcome) {
  fmt::format_to(out,
                 "<section class=\"card\"><h2>Print time, s</h2><div class=\"scroll\">"
                 "<table class=\"data\"><thead><tr><th>tolerance</th>");
  for (const double tolerance_mm : outcome.tolerances_mm) {
    fmt::format_to(out, "<th>{:g} µm</th>", 1e3 * tolerance_mm);
  }
  fmt::format_to(out, "</tr></thead><tbody>\n");
  const auto write = [&](std::string_view name, std::string_view attributes, const auto& cell) {
    fmt::format_to(out, "<tr{}><th scope=\"row\">{}</th>", attributes, escape_html(name));
    for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
      const std::string text = cell(i);
      fmt::format_to(out, "<td{}>{}</td>", text == "—" ? " class=\"none\"" : "", text);
    }
    fmt::format_to(out, "</tr>\n");
  };
  for (const FastestOfContender& contender : outcome.contenders) {
    write(contender.name, contender.name == kUnflex ? " class=\"unflex\"" : "", [&](std::size_t i) {
      return contender.at[i] ? time_text(contender.at[i]->time_s) : std::string("—");
    });
  }
  write(kAtFeed, "", [&](std::size_t) { return time_text(outcome.at_feed_s); });
  write("unflex saves", "", [&](std::size_t i) { return saving_text(outcome, i); });
  const report::Plot plot = plot_of(outcome);
  fmt::format_to(out,
                 "</tbody></table></div>\n<p class=\"note\">unflex saves: of the time of the best "
                 "other. Always at F: length over F; no timing is shorter while F stays.</p>\n"
                 "<figure class=\"picture\">{}{}</figure></section>\n",
                 report::svg_legend(plot), report::svg_plot(plot));
}

}  // namespace

std::string to_html(const FastestOutcome& outcome) {
  std::string body;
  const Sink out = std::back_inserter(body);
  write_lead(out, outcome);
  write_times(out, outcome);
  write_warnings(out, outcome.warnings);
  write_settings(out, {{"unflex", outcome.version}}, outcome.printer);
  return report::html_page({.title = "How fast, " + outcome.input,
                            .style = std::string(assets::fastest_css),
                            .body = std::move(body),
                            .script = {}});
}

std::string to_svg(const FastestOutcome& outcome) { return report::svg_picture(plot_of(outcome)); }

}  // namespace unflex::study
