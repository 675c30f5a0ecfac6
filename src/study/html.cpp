#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "assets.hpp"
#include "html_figures.hpp"
#include "report_parts.hpp"
#include "step.hpp"
#include "unflex/core/math.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/svg_plot.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {
namespace {

using report::escape_html;
using report::micrometres_text;
using Sink = std::back_insert_iterator<std::string>;

// Bar lengths are proportional to the logarithm of the error over this.
constexpr double kBarFrom_mm = 1e-5;

const MethodResult& by(const CaseResult& result, Method method) {
  return result.methods[static_cast<std::size_t>(method)];
}

bool is_unflex(Method method) { return method >= Method::unflex_2x; }

void write_lead(Sink out, const Outcome& outcome) {
  const CaseResult& first = outcome.cases.front();
  const auto max = [&](Method method) {
    const MethodResult& result = by(first, method);
    return result.used ? micrometres_text(result.straying[0].max_mm) + " µm" : std::string("—");
  };
  fmt::format_to(
      out,
      "<section class=\"card\"><p class=\"lead\">{}: the nozzle strays up to <b>{}</b> "
      "from the path as it is, <b>{}</b> with a ZV shaper, <b>{}</b> with a filtered "
      "B-spline, and <b>{}</b> with unflex, whose base may accelerate four times as hard "
      "as the plan.</p>\n",
      outcome.input.empty() ? "A corner of 10 mm sides with a full stop in it"
                            : escape_html(outcome.input),
      max(Method::uncompensated), max(Method::zv), max(Method::filtered_spline),
      max(Method::unflex_4x));
  fmt::format_to(out, "<p class=\"note\">{}. Bars are logarithmic.</p><div class=\"bars\">\n",
                 escape_html(first.description));
  double most_mm = 2.0 * kBarFrom_mm;
  for (const MethodResult& method : first.methods) {
    most_mm = std::max(most_mm, method.straying[0].max_mm);
  }
  const double longest = math::log(most_mm / kBarFrom_mm);
  for (const MethodResult& method : first.methods) {
    if (!method.used) {
      continue;
    }
    const double max_mm = method.straying[0].max_mm;
    const double share =
        std::clamp(math::log(std::max(max_mm, kBarFrom_mm) / kBarFrom_mm) / longest, 0.0, 1.0);
    fmt::format_to(out,
                   "<span>{}</span><div class=\"bar{}\"><i style=\"--share:{:.3f}\"></i>{} "
                   "µm</div>\n",
                   name(method.method),
                   method.method == Method::uncompensated ? " before"
                   : is_unflex(method.method)             ? " after"
                                                          : "",
                   share, micrometres_text(max_mm));
  }
  fmt::format_to(out, "</div></section>\n");
}

void write_row_start(Sink out, Method method) {
  fmt::format_to(out, "<tr{}><th scope=\"row\">{}</th>",
                 is_unflex(method) ? " class=\"unflex\"" : "", name(method));
}

void write_maxima(Sink out, const Outcome& outcome) {
  fmt::format_to(out,
                 "<section class=\"card\"><h2>{}, µm</h2><div class=\"scroll\">"
                 "<table class=\"data\"><thead><tr><th>method</th>",
                 report::term("Largest contour error",
                              "Distance of the nozzle from the path while the plan moves, at the "
                              "moment where it is largest"));
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "<th scope=\"col\">{}</th>", report::term(result.name, result.description));
  }
  fmt::format_to(out, "</tr></thead><tbody>\n");
  for (std::size_t i = 0; i < outcome.cases.front().methods.size(); ++i) {
    write_row_start(out, static_cast<Method>(i));
    for (const CaseResult& result : outcome.cases) {
      const MethodResult& method = result.methods[i];
      if (method.used) {
        fmt::format_to(out, "<td>{}</td>", micrometres_text(method.straying[0].max_mm));
      } else {
        fmt::format_to(out, "<td class=\"none\">{}</td>", report::term("—", method.remark));
      }
    }
    fmt::format_to(out, "</tr>\n");
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

void write_gaps(Sink out, const Outcome& outcome) {
  fmt::format_to(out,
                 "<section class=\"card\"><h2>Where the base comes to rest</h2><p>The thesis' "
                 "equations let the base stop when the plan does, although it has not caught up "
                 "yet: so far from its target, in µm.</p><div class=\"scroll\"><table "
                 "class=\"data\"><thead><tr><th>method</th>");
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "<th scope=\"col\">{}</th>", report::term(result.name, result.description));
  }
  fmt::format_to(out, "</tr></thead><tbody>\n");
  for (const Method method :
       {Method::thesis_least_squares, Method::thesis_velocity_defects, Method::unflex_4x}) {
    write_row_start(out, method);
    for (const CaseResult& result : outcome.cases) {
      fmt::format_to(out, "<td>{}</td>", micrometres_text(by(result, method).end_gap_mm));
    }
    fmt::format_to(out, "</tr>\n");
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

// Contour error plotted over the error of the frequency.
report::Plot sensitivity_plot(const CaseResult& result) {
  report::Plot plot{.title = "Contour error against the error of the natural frequency",
                    .x_label = "true frequency against the one assumed, %",
                    .y_label = "contour error max, µm",
                    .width_px = 560,
                    .height_px = 300};
  struct Shown {
    Method method;
    const char* colour;
    report::Stroke stroke;
  };
  using report::Stroke;
  for (const Shown& line : {Shown{Method::uncompensated, "--before", Stroke::dashed},
                            Shown{Method::zv, "--series-3", Stroke::solid},
                            Shown{Method::mzv, "--series-4", Stroke::dashed},
                            Shown{Method::zvd, "--series-5", Stroke::dotted},
                            Shown{Method::thesis_least_squares, "--series-6", Stroke::dashed},
                            Shown{Method::unflex_4x, "--after", Stroke::solid},
                            Shown{Method::unflex_band_4x, "--after", Stroke::dotted}}) {
    const MethodResult& method = by(result, line.method);
    if (!method.used) {
      continue;
    }
    report::PlotCurve curve{std::string(name(line.method)), line.colour, line.stroke, 2.0, {}};
    for (const std::size_t i : {1U, 2U, 0U, 3U, 4U}) {
      curve.points.push_back({100.0 * kFrequencyErrors[i], 1e3 * method.straying[i].max_mm});
    }
    plot.curves.push_back(std::move(curve));
  }
  return plot;
}

void write_depth(Sink out, const CaseResult& result) {
  const report::Plot plot = sensitivity_plot(result);
  fmt::format_to(out,
                 "<section class=\"card\"><h2>{} in depth</h2><p>What an error of the natural "
                 "frequency costs, how the motion ends, and what it asks of the machine.</p>{}"
                 "<div class=\"wide\">{}</div>",
                 escape_html(result.name), report::svg_legend(plot), report::svg_plot(plot));
  fmt::format_to(
      out,
      "<div class=\"scroll\"><table class=\"data\"><thead><tr><th>method</th><th>RMS, µm</th>"
      "<th>−10 %</th><th>−5 %</th><th>exact</th><th>+5 %</th><th>+10 %</th><th>{}</th><th>{}</th>"
      "<th>{}</th><th>{}</th>"
      "<th>base, mm/s</th><th>base, mm/s²</th><th>{}</th></tr></thead><tbody>\n",
      report::term("corners, µm",
                   "How far the nozzle passes from the corners of the path, root mean square"),
      report::term("at most, µm", "The largest of these distances"),
      report::term("after, µm", "Largest contour error from the plan's end on"),
      report::term("gap, µm", "How far from its target the base comes to rest"),
      report::term("longer, ms", "How much later than the plan the base comes to rest"));
  for (const MethodResult& method : result.methods) {
    write_row_start(out, method.method);
    if (!method.used) {
      fmt::format_to(out, "<td class=\"none\" colspan=\"13\">{}</td></tr>\n",
                     escape_html(method.remark));
      continue;
    }
    fmt::format_to(out, "<td>{}</td>", micrometres_text(method.straying[0].rms_mm()));
    for (const std::size_t i : {1U, 2U, 0U, 3U, 4U}) {
      fmt::format_to(out, "<td>{}</td>", micrometres_text(method.straying[i].max_mm));
    }
    fmt::format_to(out,
                   "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.0f}</td><td>{:.0f}</td>"
                   "<td>{:.0f}</td></tr>\n",
                   micrometres_text(method.straying[0].corners.rms_mm()),
                   micrometres_text(method.straying[0].corners.max_mm),
                   micrometres_text(method.straying[0].after_max_mm),
                   micrometres_text(method.end_gap_mm), method.base_peak.velocity_mm_s,
                   method.base_peak.accel_mm_s2, std::max(0.0, method.longer_s * 1e3));
  }
  fmt::format_to(out, "</tbody></table></div>\n");
  for (const MethodResult& method : result.methods) {
    if (method.used && !method.remark.empty()) {
      fmt::format_to(out, "<p class=\"note\">{}: {}.</p>\n", name(method.method),
                     escape_html(method.remark));
    }
  }
  fmt::format_to(out, "</section>\n");
}

void write_figures(Sink out, const Outcome& outcome) {
  if (by(outcome.cases.front(), Method::uncompensated).trace.nozzle.empty()) {
    return;
  }
  fmt::format_to(out,
                 "<section class=\"card\"><h2>Figures</h2><div class=\"choose\">"
                 "<label>Case <select id=\"case\">");
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "<option value=\"{0}\">{0}: {1}</option>", escape_html(result.name),
                   escape_html(result.description));
  }
  fmt::format_to(out, "</select></label><label>Method <select id=\"method\">");
  for (std::size_t i = 0; i < outcome.cases.front().methods.size(); ++i) {
    const auto method = static_cast<Method>(i);
    fmt::format_to(out, "<option value=\"{}\"{}>{}</option>", i,
                   method == Method::unflex_4x ? " selected" : "", name(method));
  }
  fmt::format_to(out,
                 "</select></label></div><p id=\"no-figures\" class=\"note\" hidden>The method "
                 "cannot be used in this case, or does there what it does in the reference."
                 "</p>\n");
  for (const CaseResult& result : outcome.cases) {
    for (const MethodResult& method : result.methods) {
      if (!method.trace.nozzle.empty()) {
        fmt::format_to(out, "<div data-figures=\"{} {}\"{}>{}</div>\n", escape_html(result.name),
                       static_cast<int>(method.method),
                       &result == &outcome.cases.front() && method.method == Method::unflex_4x
                           ? ""
                           : " hidden",
                       figures(result, method));
      }
    }
  }
  fmt::format_to(out, "</section>\n");
}

// The size of the problem of each method that solves one, and how long it takes.
void write_problems(Sink out, const Outcome& outcome) {
  fmt::format_to(out,
                 "<section class=\"card\"><h2>How large the problem is</h2><p>{} of both axes, "
                 "systems of equations solved, and milliseconds in which the base was made. "
                 "Methods that solve nothing are left out.</p><div class=\"scroll\"><table "
                 "class=\"data\"><thead><tr><th>method</th>",
                 report::term("Unknowns/equations",
                              "The banded engine leaves out all equations where the axis is one "
                              "model of one mode; limits of the base are not counted"));
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "<th scope=\"col\">{}</th>", report::term(result.name, result.description));
  }
  fmt::format_to(out, "</tr></thead><tbody>\n");
  for (std::size_t i = 0; i < outcome.cases.front().methods.size(); ++i) {
    if (outcome.cases.front().methods[i].size.unknowns == 0) {
      continue;
    }
    write_row_start(out, static_cast<Method>(i));
    for (const CaseResult& result : outcome.cases) {
      const MethodResult& method = result.methods[i];
      fmt::format_to(out, "<td>{}/{}<br>{}<br>{} ms</td>", method.size.unknowns,
                     method.size.equations, method.iterations, milliseconds_text(method.base_s));
    }
    fmt::format_to(out, "</tr>\n");
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

void write_chains(Sink out, const Outcome& outcome) {
  if (outcome.chains.empty()) {
    return;
  }
  fmt::format_to(out,
                 "<section class=\"card\"><h2>From coarse to fine</h2><p>unflex 4× with one node "
                 "period after the other: iterations and milliseconds for both axes, from scratch "
                 "and from the coarser solution. The banded engine always starts from the optimum "
                 "without limits, so for it the two are the same.</p><div class=\"scroll\">"
                 "<table class=\"data\"><thead><tr><th>case</th><th>engine</th><th>period</th>"
                 "<th>contour max, µm</th><th>from scratch</th><th>from coarse</th></tr></thead>"
                 "<tbody>\n");
  for (const ChainResult& chain : outcome.chains) {
    for (const ChainStep& step : chain.steps) {
      fmt::format_to(out,
                     "<tr><th scope=\"row\">{}</th><td>{}</td><td>{:g} ms</td><td>{}</td>"
                     "<td>{} in {:.2f} ms</td><td>{} in {:.2f} ms</td></tr>\n",
                     chain.case_name, chain.engine, step.period_s * 1e3,
                     micrometres_text(step.contour_max_mm), step.cold_iterations, step.cold_s * 1e3,
                     step.warm_iterations, step.warm_s * 1e3);
    }
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

void write_steps(Sink out) {
  fmt::format_to(
      out,
      "<section class=\"card\"><h2>A step and a staircase</h2><p>The base jumps by 1 mm at "
      "once, or as shapers have it in steps of their pulses' weights; ω {} rad/s. Base "
      "dotted.</p>{}<div class=\"scroll\"><table class=\"data\"><thead><tr><th>shaper, ζ"
      "</th><th>overshoot</th><th>within 5 % after</th><th>{}</th><th>10 % off</th></tr>"
      "</thead><tbody>\n",
      kStepOmega_rad_s, step_figures(),
      report::term("left", "Amplitude of the swing that the last pulse leaves"));
  for (const StepRow& row : step_table()) {
    fmt::format_to(
        out,
        "<tr><th scope=\"row\">{}, {}</th><td>{:.1f} %</td><td>{}</td><td>{:.1f} %</td>"
        "<td>{:.1f} %</td></tr>\n",
        row.shaper, row.zeta, 100.0 * row.overshoot,
        row.settled_s ? fmt::format("{:.1f} ms", 1e3 * *row.settled_s) : std::string("—"),
        100.0 * row.left, 100.0 * row.left_off);
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

}  // namespace

std::string to_html(const Outcome& outcome) {
  std::string body;
  const Sink out = std::back_inserter(body);
  write_lead(out, outcome);
  write_maxima(out, outcome);
  write_gaps(out, outcome);
  write_depth(out, outcome.cases.front());
  write_figures(out, outcome);
  write_problems(out, outcome);
  write_chains(out, outcome);
  if (outcome.input.empty()) {
    write_steps(out);
  }
  write_warnings(out, outcome.warnings);
  write_settings(out, {{"unflex", outcome.version}, {"engine", outcome.engine}}, outcome.printer);
  return report::html_page(
      {.title = outcome.input.empty() ? "Study of the thesis' corner" : "Study of " + outcome.input,
       .style = std::string(assets::study_css),
       .body = std::move(body),
       .script = std::string(assets::study_js)});
}

}  // namespace unflex::study
