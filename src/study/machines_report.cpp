// The findings of the bench of real machines: for people, for programs and as a page.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>

#include "assets.hpp"
#include "report_parts.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/study/machines.hpp"

namespace unflex::study {
namespace {

using report::escape_html;
using report::Json;
using report::micrometres_text;
using Sink = std::back_insert_iterator<std::string>;

// "-7 %"; "as recorded" for none.
std::string shift_text(std::size_t shift) {
  return shift == kNoShift ? "as recorded"
                           : fmt::format("{:+.0f} %", 100.0 * kMachineShifts[shift]);
}

void write_bars(Sink out, const MachineResult& machine) {
  double most_mm = 1e-9;
  for (const ContenderResult& of : machine.shifted[kNoShift]) {
    most_mm = std::max(most_mm, of.rms_mm);
  }
  fmt::format_to(out, "<div class=\"machine\">\n");
  for (std::size_t c = 0; c < kContenderCount; ++c) {
    const auto contender = static_cast<Contender>(c);
    const ContenderResult& of = machine.of(contender);
    fmt::format_to(out,
                   "<span>{}</span><span><i class=\"{}\" style=\"width:{:.1f}%\"></i></span>"
                   "<b>{} µm RMS, {} p99, {} from corners</b>\n",
                   name(contender), contender == Contender::unflex ? "unflex" : "other",
                   100.0 * of.rms_mm / most_mm, micrometres_text(of.rms_mm),
                   micrometres_text(of.p99_mm), micrometres_text(of.corner_rms_mm));
  }
  fmt::format_to(out, "</div>\n");
}

}  // namespace

std::string to_text(const MachinesOutcome& outcome) {
  std::string text;
  const Sink out = std::back_inserter(text);
  fmt::format_to(out, "{}\n{:<28}", outcome.input, "contour, RMS (p99) µm");
  for (std::size_t c = 0; c < kContenderCount; ++c) {
    fmt::format_to(out, "{:>18}", name(static_cast<Contender>(c)));
  }
  fmt::format_to(out, "{:>18}\n", "of best shaper");
  for (const MachineResult& machine : outcome.machines) {
    fmt::format_to(out, "  {:<26}", machine.name);
    for (const ContenderResult& of : machine.shifted[kNoShift]) {
      fmt::format_to(
          out, "{:>18}",
          fmt::format("{} ({})", micrometres_text(of.rms_mm), micrometres_text(of.p99_mm)));
    }
    fmt::format_to(out, "{:>18.2f}\n", machine.ratio(kNoShift));
  }
  fmt::format_to(out, "\n{:<28}", "corners, RMS (largest) µm");
  for (std::size_t c = 0; c < kContenderCount; ++c) {
    fmt::format_to(out, "{:>18}", name(static_cast<Contender>(c)));
  }
  fmt::format_to(out, "{:>18}\n", "corners");
  for (const MachineResult& machine : outcome.machines) {
    fmt::format_to(out, "  {:<26}", machine.name);
    for (const ContenderResult& of : machine.shifted[kNoShift]) {
      fmt::format_to(out, "{:>18}",
                     fmt::format("{} ({})", micrometres_text(of.corner_rms_mm),
                                 micrometres_text(of.corner_max_mm)));
    }
    fmt::format_to(out, "{:>18}\n", machine.corners);
  }
  fmt::format_to(out, "\n{:<28}", "frequencies off by");
  for (std::size_t s = 0; s < kMachineShifts.size(); ++s) {
    fmt::format_to(out, "{:>24}", shift_text(s));
  }
  fmt::format_to(out, "\n");
  for (const MachineResult& machine : outcome.machines) {
    fmt::format_to(out, "  {:<26}", machine.name);
    for (std::size_t s = 0; s < kMachineShifts.size(); ++s) {
      fmt::format_to(
          out, "{:>24}",
          fmt::format("{} of {}, {:.2f}", micrometres_text(machine.of(Contender::unflex, s).rms_mm),
                      micrometres_text(machine.best_shaper(s).rms_mm), machine.ratio(s)));
    }
    fmt::format_to(out, "\n");
  }
  for (const MachineResult& machine : outcome.machines) {
    fmt::format_to(out, "\n{}\n{}\n", machine.name, machine.description);
    if (machine.failed_runs > 0) {
      fmt::format_to(out, "{} runs without a solution, measured as sliced\n", machine.failed_runs);
    }
  }
  return text;
}

std::string to_json(const MachinesOutcome& outcome) {
  Json json = head_json(outcome);
  json["machines"] = Json::array();
  for (const MachineResult& machine : outcome.machines) {
    Json contenders = Json::array();
    for (std::size_t c = 0; c < kContenderCount; ++c) {
      const auto contender = static_cast<Contender>(c);
      const ContenderResult& of = machine.of(contender);
      Json shifted = Json::array();
      for (std::size_t s = 0; s < kMachineShifts.size(); ++s) {
        shifted.push_back({{"frequency_shift", kMachineShifts[s]},
                           {"contour_rms_mm", machine.of(contender, s).rms_mm},
                           {"corner_rms_mm", machine.of(contender, s).corner_rms_mm}});
      }
      contenders.push_back({{"name", name(contender)},
                            {"contour_rms_mm", of.rms_mm},
                            {"contour_p99_mm", of.p99_mm},
                            {"contour_max_mm", of.max_mm},
                            {"corner_rms_mm", of.corner_rms_mm},
                            {"corner_max_mm", of.corner_max_mm},
                            {"shifted", std::move(shifted)}});
    }
    json["machines"].push_back({{"machine", machine.name},
                                {"description", machine.description},
                                {"corners", machine.corners},
                                {"contenders", std::move(contenders)},
                                {"failed_runs", machine.failed_runs}});
  }
  json["warnings"] = outcome.warnings;
  return report::dump(json);
}

std::string to_html(const MachinesOutcome& outcome) {
  std::string body;
  const Sink out = std::back_inserter(body);
  for (const MachineResult& machine : outcome.machines) {
    fmt::format_to(
        out,
        "<section class=\"card\"><h2>{}</h2>\n<p>With unflex the nozzle strays {:.2f} "
        "times as far as with the best of ZV, MZV, EI and what Klipper's calibration "
        "recommends; with all frequencies of the machine 7 % lower {:.2f}, and 7 % higher "
        "{:.2f} times.</p>\n",
        escape_html(machine.name), machine.ratio(kNoShift), machine.ratio(0), machine.ratio(2));
    write_bars(out, machine);
    fmt::format_to(out, "<p class=\"note\">{}</p></section>\n", escape_html(machine.description));
  }
  return report::html_page({.title = "Real machines, " + outcome.input,
                            .style = std::string(assets::machines_css),
                            .body = std::move(body),
                            .script = {}});
}

}  // namespace unflex::study
