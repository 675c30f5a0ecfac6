#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "read_print.hpp"
#include "step_rates.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/compensable.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/limit_keys.hpp"
#include "unflex/run/extruded_path.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"
#include "whole_plan.hpp"

namespace unflex::flow {
namespace {

// Programs that name themselves in the comments they write.
constexpr std::string_view kSlicers[] = {"PrusaSlicer",  "SuperSlicer", "OrcaSlicer", "BambuStudio",
                                         "Bambu Studio", "Slic3r",      "Cura",       "Simplify3D",
                                         "ideaMaker",    "KISSlicer",   "Kiri:Moto",  "ArcWelder"};

// The comment in which a slicer names itself, if this is one.
std::string slicer_named(std::string_view content) {
  const std::size_t semicolon = content.find(';');
  if (semicolon != 0) {
    return {};
  }
  for (const std::string_view name : kSlicers) {
    if (content.find(name) != std::string_view::npos) {
      std::string_view text = content.substr(1);
      text.remove_prefix(std::min(text.find_first_not_of("; \t"), text.size()));
      return std::string(text);
    }
  }
  return {};
}

std::string command_name(const gcode::Command& command) {
  switch (command.kind) {
    case gcode::CommandKind::traditional:
      return command.subnumber >= 0
                 ? fmt::format("{}{}.{}", command.letter, command.number, command.subnumber)
                 : fmt::format("{}{}", command.letter, command.number);
    case gcode::CommandKind::extended:
      return command.name;
    case gcode::CommandKind::malformed:
      return "(not understood)";
    case gcode::CommandKind::none:
      break;
  }
  return {};
}

class Inspector {
 public:
  Inspector(Inspection& result, const machine::Settings& settings)
      : result_(&result),
        firmware_(settings.printer.firmware),
        path_(firmware_),
        plan_(settings),
        steps_(machine::firmware_config(settings), run::step_rules(settings)),
        absolute_e_(!settings.printer.relative_extrusion) {
    result_->min_mm = on_all_axes(std::numeric_limits<double>::infinity());
    result_->max_mm = on_all_axes(-std::numeric_limits<double>::infinity());
    result_->lowest_accel_mm_s2 = std::numeric_limits<double>::infinity();
  }

  void add(const run::Piece& piece, const compensate::Setup& setup) {
    for (const gcode::Event& event : piece.events) {
      add_event(event);
    }
    piece.is_run ? path_.compensate(piece) : path_.keep(piece);
    if (piece.is_run) {
      result_->runs += piece.begins_run() ? 1 : 0;
      result_->run_time_s += planner::duration_s(piece.moves);
      const compensate::Course course(piece.before, piece.moves, piece.after);
      result_->windows += compensate::windows_to_solve(
          compensate::mesh(course, compensate::node_grid(course, setup), setup));
    }
  }

  // input_name: for messages.
  void finish(const std::string& input_name) {
    plan_.finish([this](const planner::PlannedMove& move) { add_move(move); });
    if (result_->min_mm.x > result_->max_mm.x) {
      result_->min_mm = result_->max_mm = {};
    }
    if (result_->counts.moves == 0) {
      result_->lowest_accel_mm_s2 = 0.0;
    }
    if (linear_moves_ > 0) {
      result_->commands["G1"] += linear_moves_;
    }
    add_step_rates(steps_.largest(), nullptr, result_->step_rates);
    warn_of_sliced_steps(steps_.breaches(), input_name, result_->warnings);
    result_->extruded_path = path_.path();
    result_->unknown_commands = path_.unknown_commands();
    result_->absolute_e = extruded_absolute_ >= 0;
    result_->dialect = slicers_.empty() ? "unknown slicer" : slicers_;
  }

 private:
  void add_event(const gcode::Event& event) {
    if (event.added) {
      run::count_kept_moves(event, firmware_, result_->kept_moves);
      plan(event);
      return;
    }
    ++result_->counts.lines;
    result_->counts.bytes += event.line.text.size();
    const bool stops_nothing =
        event.kind == gcode::EventKind::passive || event.kind == gcode::EventKind::border;
    result_->counts.passive_lines += stops_nothing ? 1 : 0;
    result_->counts.limit_lines += event.kind == gcode::EventKind::limits ? 1 : 0;
    result_->counts.barrier_lines += event.kind == gcode::EventKind::barrier ? 1 : 0;
    result_->reference_time_s += event.dwell_s;
    if (event.line.content().starts_with("G1 ")) {
      ++linear_moves_;  // most lines are such; the event has their content
    } else {
      add_command(gcode::parse(event.line.content()));
    }
    for (const gcode::Segment& segment : event.segments) {
      extruded_absolute_ += segment.extruding() ? (absolute_e_ ? 1 : -1) : 0;
    }
    if (slicers_.empty()) {
      slicers_ = slicer_named(event.line.content());
    }
    run::count_kept_moves(event, firmware_, result_->kept_moves);
    if (event.kind == gcode::EventKind::limits || event.kind == gcode::EventKind::barrier) {
      add_limits(event);
    }
    plan(event);
  }

  void add_limits(const gcode::Event& event) {
    for (const machine::LimitValue& limit : machine::limit_values(*event.limits)) {
      LimitInPrint& known = result_->limits[limit.key];
      if (known.times++ == 0) {
        known.first_value = limit.value;
        known.first_line = event.line.number;
      }
    }
  }

  void add_command(const gcode::Command& command) {
    if (command.kind != gcode::CommandKind::none) {
      ++result_->commands[command_name(command)];
    }
    result_->counts.arcs += command.is('G', 2) || command.is('G', 3) ? 1 : 0;
    absolute_e_ = command.is('M', 82) || (absolute_e_ && !command.is('M', 83));
  }

  void plan(const gcode::Event& event) {
    plan_.add(event, [this](const planner::PlannedMove& move) { add_move(move); });
  }

  void add_move(const planner::PlannedMove& move) {
    const gcode::Segment& segment = move.segment;
    result_->filament_mm += segment.delta(gcode::E);
    result_->reference_time_s += move.duration_s();
    steps_.play(move);
    if (!move.kinematic) {
      ++result_->counts.extrude_only_moves;
      return;
    }
    ++result_->counts.moves;
    result_->moving_time_s += move.duration_s();
    result_->path_length_mm += move.length_mm;
    if (segment.extruding()) {
      ++result_->counts.extruding_moves;
      for_each_axis(
          [](double& min_mm, double& max_mm, double start_mm, double end_mm) {
            min_mm = std::min({min_mm, start_mm, end_mm});
            max_mm = std::max({max_mm, start_mm, end_mm});
          },
          result_->min_mm, result_->max_mm, xy_of(segment.start_mm), xy_of(segment.end_mm));
      result_->z_max_mm = std::max(result_->z_max_mm, segment.end_mm[gcode::Z]);
    }
    result_->lowest_accel_mm_s2 = std::min(result_->lowest_accel_mm_s2, move.accel_mm_s2);
    result_->highest_accel_mm_s2 = std::max(result_->highest_accel_mm_s2, move.accel_mm_s2);
  }

  Inspection* result_;
  Firmware firmware_;
  run::ExtrudedPath path_;
  WholePlan plan_;
  verify::StepGauge steps_;
  std::string slicers_;
  std::size_t linear_moves_ = 0;
  bool absolute_e_;
  long extruded_absolute_ = 0;  // extruding moves in M82 minus those in M83
};

}  // namespace

Result<Inspection> inspect(const Job& job, Progress& progress) {
  const compensate::Setup setup = run::compensate_setup(job.settings);
  Inspection result;
  Inspector inspector(result, job.settings);
  Result<std::vector<std::string>> warnings =
      read_print(job, progress, [&](const run::Piece& piece) { inspector.add(piece, setup); });
  if (!warnings) {
    return tl::unexpected(warnings.error());
  }
  add_step_limits(job.settings, result.step_rates);
  inspector.finish(job.input_name);
  result.warnings.insert(result.warnings.end(), warnings->begin(), warnings->end());
  return result;
}

}  // namespace unflex::flow
