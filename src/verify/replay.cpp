#include "replay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <string_view>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/compensable.hpp"
#include "unflex/gcode/tool_check.hpp"
#include "unflex/planner/printer_shaper.hpp"

namespace unflex::verify {
namespace {

// Whether a move is only a rounding remainder: it moves filament alone, and no more than rounding
// to five digits may leave until the next absolute E.
bool is_nothing(const gcode::Event& event, const gcode::ModalState& modal) {
  constexpr double kRounding_mm = 3.5e-5;
  if (event.segments.size() != 1 || event.segments.front().length_mm() > 0.0) {
    return false;
  }
  return modal.e_is_absolute() && std::abs(event.segments.front().delta(gcode::E)) <=
                                      kRounding_mm * std::max(1.0, modal.filament_factor());
}

bool only_word(const gcode::Command& command, char letter) {
  return command.words.size() == 1 && command.words.front().letter == letter &&
         command.words.front().value.has_value();
}

planner::Filters filters_of(const gcode::ModalState& state) {
  return {state.shaper, state.pressure_advance};
}

// The lead-in by the line that announces a run; 0 if the line names none.
double lead_in_s(std::string_view mark) {
  mark.remove_prefix(kRunMark.size());
  mark = mark.substr(0, mark.find(kFreeTimingWord));
  return mark.starts_with(kLeadInWord)
             ? std::max(0.0, parse_number(mark.substr(kLeadInWord.size())).value_or(0.0))
             : 0.0;
}

}  // namespace

bool is_known_addition(std::string_view content, Firmware firmware) {
  if (content.starts_with(kOwnMark)) {
    return true;
  }
  const gcode::Command command = gcode::parse(content);
  const FirmwareWriting& writing = spec_of(firmware).writing;
  if (command.kind == gcode::CommandKind::extended && !writing.added_names.empty()) {
    return std::ranges::find(writing.added_names, command.name) != writing.added_names.end();
  }
  if (std::ranges::any_of(writing.added_codes,
                          [&](int number) { return command.is('M', number); })) {
    return true;
  }
  if (command.is('G', 4)) {
    return only_word(command, 'P') && *command.words.front().value == 0.0;
  }
  if (command.is('G', 92)) {
    return only_word(command, 'E');
  }
  if (command.is('G', 1)) {
    return only_word(command, 'F');
  }
  constexpr std::array<std::pair<char, int>, 6> kModes = {
      {{'M', 82}, {'M', 83}, {'G', 90}, {'G', 91}, {'G', 20}, {'G', 21}}};
  return command.words.empty() && std::any_of(kModes.begin(), kModes.end(), [&](const auto& mode) {
           return command.is(mode.first, mode.second);
         });
}

Replay::Replay(std::istream& stream, std::string name, const gcode::InterpreterOptions& interpreter,
               const planner::Limits& limits, const planner::FirmwareConfig& fixed,
               ReplayedFile file)
    : reader_(stream, std::move(name)),
      interpreter_(interpreter),
      plan_(limits, fixed, PlanQueue::Motion::played),
      resting_plan_(limits, fixed, PlanQueue::Motion::planned),
      fixed_(fixed),
      file_(file) {
  sections_.push_back(Section{});
}

bool Replay::find_move(const PlanQueue& plan) {
  while (!plan.has_move()) {
    // The end of the file is a section in which nothing follows.
    if (plan.at_section_end() || at_end_) {
      return false;
    }
    read_line();
  }
  return true;
}

bool Replay::has_move() { return find_move(plan_); }

bool Replay::next(planner::PlannedMove& move) {
  if (!find_move(plan_)) {
    return false;
  }
  move = plan_.take();
  return true;
}

bool Replay::next_resting(planner::PlannedMove& move) {
  if (!find_move(resting_plan_)) {
    return false;
  }
  move = resting_plan_.take();
  return true;
}

double Replay::filament_factor() const {
  const double read = interpreter_.state().filament_factor();
  const std::optional<Regime>& begun = section().regime;
  return begun ? std::max(begun->modal.filament_factor(), read) : read;
}

void Replay::next_section() {
  for_each_plan([](PlanQueue& plan) { plan.next_section(); });
  sections_.pop_front();
}

void Replay::join_over_barrier() {
  const Section before = section();
  next_section();
  next_section();
  Section& joined = sections_.front();
  joined.compensated = joined.compensated || before.compensated;
  if (before.regime.has_value()) {
    joined.regime = before.regime;
  }
}

void Replay::read_line() {
  gcode::Line line;
  const Result<bool> more = reader_.next(line);
  if (!more) {
    error_ = more.error();
  }
  if (more && *more) {
    ++lines_read_;
    if (listener_) {
      listener_(line);
    }
    if (file_ == ReplayedFile::sliced_with_approaches) {
      read_approach(line);
    }
  }
  const Regime before{interpreter_.state(), plan_.limits()};
  if (!more || !*more) {
    return end_file(before);
  }
  gcode::Event event = interpreter_.interpret(std::move(line));
  if (const Status told = gcode::check_tool(event, interpreter_.options().tools, reader_.name());
      !told) {
    error_ = told.error();
    return end_file(before);
  }
  read_event(std::move(event), before);
}

void Replay::end_file(const Regime& before) {
  for_each_plan([](PlanQueue& plan) { plan.stop(); });
  at_end_ = true;
  Section end;
  end.kind = SectionKind::end;
  end.line.number = lines_read_;
  end.regime = before;
  end.advance = before.modal.pressure_advance;
  push_section(std::move(end));
}

// The emitted file has the approach as a line. So it is read as a line here, too.
void Replay::read_approach(const gcode::Line& line) {
  if (std::optional<std::string> text = interpreter_.approach(line)) {
    const Regime before{interpreter_.state(), plan_.limits()};
    gcode::Event event = interpreter_.interpret({std::move(*text), line.number});
    event.added = true;
    read_event(std::move(event), before);
  }
}

void Replay::read_event(gcode::Event event, const Regime& before) {
  const int selected = event.tool.value_or(tool_);
  // Filament is pushed when the line has been read.
  const double pushed_mm = std::transform_reduce(
      event.segments.begin(), event.segments.end(), pushed_mm_, std::plus<>(),
      [](const gcode::Segment& segment) { return std::max(0.0, segment.delta(gcode::E)); });
  understand(std::move(event), before);
  pushed_mm_ = pushed_mm;
  // Every firmware stops at such a line, so a section ends there and another one has begun.
  tool_ = sections_.back().tool = selected;
}

void Replay::understand(gcode::Event event, const Regime& before) {
  // A move's segments are added below, and wait there.
  if (event.kind != gcode::EventKind::move || is_nothing(event, before.modal)) {
    for_each_plan([&](PlanQueue& plan) { plan.apply(event); });
  }
  switch (event.kind) {
    case gcode::EventKind::passive: {
      const bool motion = gcode::names_position(event.line.content());
      place(std::move(event.line), before, motion);
      break;
    }
    case gcode::EventKind::limits:
      place(std::move(event.line), before, false);
      break;
    case gcode::EventKind::move:
      if (is_nothing(event, before.modal)) {
        // In the other file, where nothing was rounded before, this line does not move. So it is
        // treated as no move here, too.
        if (event.segments.front().start_known) {
          place(std::move(event.line), before, true);
        } else {
          if (!event.segments.front().start_assumed) {
            for_each_plan([](PlanQueue& plan) { plan.stop(); });
          }
          event.segments.clear();
          read_section(SectionKind::barrier, std::move(event), before);
        }
      } else if (stays_in_run(event)) {
        read_run_moves(std::move(event), before);
      } else {
        read_section(SectionKind::move, std::move(event), before);
      }
      break;
    case gcode::EventKind::border:
      read_section(SectionKind::border, std::move(event), before);
      break;
    case gcode::EventKind::barrier:
      for_each_plan([](PlanQueue& plan) { plan.stop(); });
      read_section(SectionKind::barrier, std::move(event), before);
      break;
  }
}

bool Replay::stays_in_run(const gcode::Event& event) const {
  // The sliced file tells what may be compensated. An emitted line of a few µm may look too steep
  // by itself, so every move of an announced run belongs to the run.
  return in_compensated_run_ || gcode::compensable(event, fixed_.firmware);
}

void Replay::read_run_moves(gcode::Event event, const Regime& before) {
  Section& run = sections_.back();
  if (!run.regime.has_value()) {
    run.regime = before;
  }
  run.advance = before.modal.pressure_advance;
  if (!run.compensated) {
    place(std::move(event.line), before, true);
  }
  for_each_plan([&](PlanQueue& plan) { plan.add(event.segments); });
}

void Replay::read_section(SectionKind kind, gcode::Event event, const Regime& before) {
  Section section;
  section.kind = kind;
  section.regime = before;
  section.advance = before.modal.pressure_advance;
  section.dwell_s = event.dwell_s;
  if (kind == SectionKind::barrier) {
    section.switching_s =
        planner::switching_s(fixed_, filters_of(before.modal), filters_of(interpreter_.state()));
  }
  section.moves_by_itself = event.position_lost;
  section.is_approach = event.added;
  section.may_be_added =
      kind == SectionKind::barrier && is_known_addition(event.line.content(), fixed_.firmware);
  section.line = std::move(event.line);

  // The announcement of a run also holds if unflex stops the machine before the first move.
  const Section& ended = sections_.back();
  Section run;
  run.compensated = section.may_be_added && ended.compensated && !ended.regime.has_value();
  run.lead_in_s = run.compensated ? ended.lead_in_s : 0.0;
  run.has_free_timing = run.compensated && ended.has_free_timing;
  in_compensated_run_ = run.compensated;

  push_section(std::move(section));
  for_each_plan([&](PlanQueue& plan) { plan.add(event.segments); });
  push_section(std::move(run));
}

void Replay::place(gcode::Line line, const Regime& before, bool motion) {
  if (is_emitted() && line.content().starts_with(kRunMark)) {
    sections_.back().compensated = true;
    sections_.back().lead_in_s = lead_in_s(line.content());
    sections_.back().has_free_timing = line.content().ends_with(kFreeTimingWord);
    in_compensated_run_ = true;
  } else if (line.content().starts_with(kRunEndMark)) {
    in_compensated_run_ = false;
  }
  PlacedLine placed;
  placed.line = std::move(line);
  placed.place_mm = xy_of(before.modal.position_mm);
  placed.pushed_mm = pushed_mm_;
  placed.motion = motion;
  placed.section = sections_.back().id;
  lines_.push_back(std::move(placed));
}

void Replay::push_section(Section section) {
  section.id = sections_.back().id + 1;
  section.tool = tool_;
  resting_plan_.stop();
  for_each_plan([](PlanQueue& plan) { plan.end_section(); });
  sections_.push_back(std::move(section));
}

}  // namespace unflex::verify
