#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>

#include "report_parts.hpp"
#include "step.hpp"
#include "unflex/report/format.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {
namespace {

using report::micrometres_text;
using Sink = std::back_insert_iterator<std::string>;

constexpr std::string_view kNone = "—";

void write_heading(Sink out, const Outcome& outcome) {
  fmt::format_to(out, "{}, unflex by {}\n",
                 outcome.input.empty() ? "(0,0) → (10,0) → (10,10) mm, full stop in the corner"
                                       : outcome.input,
                 outcome.engine);
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "  {:<4} {}\n", result.name, result.description);
  }
}

void write_maxima(Sink out, const Outcome& outcome) {
  fmt::format_to(out, "\n{:<28}", "contour error max, µm");
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "{:>8}", result.name);
  }
  for (std::size_t i = 0; i < outcome.cases.front().methods.size(); ++i) {
    fmt::format_to(out, "\n  {:<26}", name(static_cast<Method>(i)));
    for (const CaseResult& result : outcome.cases) {
      const MethodResult& method = result.methods[i];
      fmt::format_to(
          out, "{:>8}",
          method.used ? micrometres_text(method.straying[0].max_mm) : std::string(kNone));
    }
  }
  fmt::format_to(out, "\n");
}

// The distance from its target at which the base comes to rest: here the thesis' methods fail.
void write_gaps(Sink out, const Outcome& outcome) {
  fmt::format_to(out, "\n{:<28}", "base rests short by, µm");
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "{:>8}", result.name);
  }
  for (const Method method :
       {Method::thesis_least_squares, Method::thesis_velocity_defects, Method::unflex_4x}) {
    fmt::format_to(out, "\n  {:<26}", name(method));
    for (const CaseResult& result : outcome.cases) {
      fmt::format_to(out, "{:>8}",
                     micrometres_text(result.methods[static_cast<std::size_t>(method)].end_gap_mm));
    }
  }
  fmt::format_to(out, "\n");
}

// One case in depth: what a wrong frequency costs, and what the motion asks of the machine.
void write_case(Sink out, const CaseResult& result) {
  fmt::format_to(out, "\n{:<28}{:>8}{:>8}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n",
                 fmt::format("{}, µm", result.name), "RMS", "−10 %", "−5 %", "+5 %", "+10 %",
                 "corners", "at most", "after", "gap", "mm/s", "mm/s²", "longer");
  for (const MethodResult& method : result.methods) {
    if (!method.used) {
      fmt::format_to(out, "  {:<26}{:>8}  {}\n", name(method.method), kNone, method.remark);
      continue;
    }
    fmt::format_to(out, "  {:<26}{:>8}", name(method.method),
                   micrometres_text(method.straying[0].rms_mm()));
    for (std::size_t i = 1; i < kFrequencyErrors.size(); ++i) {
      fmt::format_to(out, "{:>8}", micrometres_text(method.straying[i].max_mm));
    }
    fmt::format_to(out, "{:>9}{:>9}{:>9}{:>9}{:>9.0f}{:>9.0f}{:>6.0f} ms{}{}\n",
                   micrometres_text(method.straying[0].corners.rms_mm()),
                   micrometres_text(method.straying[0].corners.max_mm),
                   micrometres_text(method.straying[0].after_max_mm),
                   micrometres_text(method.end_gap_mm), method.base_peak.velocity_mm_s,
                   method.base_peak.accel_mm_s2, std::max(0.0, method.longer_s * 1e3),
                   method.remark.empty() ? "" : "  ", method.remark);
  }
}

// A table for the methods that solve equations: the needs of each, with a cell for each case.
template <class Cell>
void write_needs(Sink out, const Outcome& outcome, std::string_view title, const Cell& cell) {
  std::size_t width = 6;
  for (const CaseResult& result : outcome.cases) {
    for (const MethodResult& method : result.methods) {
      width = std::max(width, cell(method).size());
    }
  }
  width += 2;
  fmt::format_to(out, "\n{:<28}", title);
  for (const CaseResult& result : outcome.cases) {
    fmt::format_to(out, "{:>{}}", result.name, width);
  }
  for (std::size_t i = 0; i < outcome.cases.front().methods.size(); ++i) {
    if (outcome.cases.front().methods[i].size.unknowns == 0) {
      continue;
    }
    fmt::format_to(out, "\n  {:<26}", name(static_cast<Method>(i)));
    for (const CaseResult& result : outcome.cases) {
      fmt::format_to(out, "{:>{}}", cell(result.methods[i]), width);
    }
  }
  fmt::format_to(out, "\n");
}

void write_problems(Sink out, const Outcome& outcome) {
  write_needs(out, outcome, "unknowns/equations", [](const MethodResult& method) {
    return fmt::format("{}/{}", method.size.unknowns, method.size.equations);
  });
  write_needs(out, outcome, "systems solved",
              [](const MethodResult& method) { return fmt::format("{}", method.iterations); });
  write_needs(out, outcome, "base made in, ms",
              [](const MethodResult& method) { return milliseconds_text(method.base_s); });
}

void write_chains(Sink out, const Outcome& outcome) {
  if (outcome.chains.empty()) {
    return;
  }
  fmt::format_to(out,
                 "\nunflex 4× from coarse to fine: iterations (ms) from scratch → from the "
                 "coarser solution\n");
  for (const ChainResult& chain : outcome.chains) {
    fmt::format_to(out, "  {:<4} {:<13}", chain.case_name, chain.engine);
    for (const ChainStep& step : chain.steps) {
      fmt::format_to(out, "  {:g} ms: {} ({:.2f}) → {} ({:.2f})", step.period_s * 1e3,
                     step.cold_iterations, step.cold_s * 1e3, step.warm_iterations,
                     step.warm_s * 1e3);
    }
    fmt::format_to(out, "\n");
  }
}

void write_steps(Sink out) {
  fmt::format_to(
      out,
      "\nA step of the base of 1 mm, ω {} rad/s: overshoot, ms until within 5 % for good, "
      "swing left by the last pulse,\nand the same with the frequency 10 % off\n",
      kStepOmega_rad_s);
  for (const StepRow& row : step_table()) {
    fmt::format_to(out, "  ζ {:<4}{:<6}{:>7.1f} %{:>8}{:>9.1f} %{:>8.1f} %\n", row.zeta, row.shaper,
                   100.0 * row.overshoot,
                   row.settled_s ? fmt::format("{:.1f}", 1e3 * *row.settled_s) : std::string(kNone),
                   100.0 * row.left, 100.0 * row.left_off);
  }
}

}  // namespace

std::string to_text(const Outcome& outcome) {
  std::string text;
  const Sink out = std::back_inserter(text);
  write_heading(out, outcome);
  write_maxima(out, outcome);
  write_gaps(out, outcome);
  if (!outcome.cases.empty()) {
    write_case(out, outcome.cases.front());
    fmt::format_to(
        out,
        "  corners, at most: how far the nozzle passes from corners of the path, RMS and "
        "largest\n"
        "  after: contour error after the plan's end; gap: how far from its target the "
        "base rests\n");
  }
  if (!outcome.cases.empty()) {
    write_problems(out, outcome);
  }
  write_chains(out, outcome);
  if (outcome.input.empty()) {
    write_steps(out);
  }
  fmt::format_to(out, "\n{} in all\n", report::duration_text(outcome.wall_s));
  return text;
}

}  // namespace unflex::study
