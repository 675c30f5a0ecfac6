#include "piece_reader.hpp"

#include <utility>

#include "unflex/gcode/command.hpp"
#include "unflex/gcode/compensable.hpp"

namespace unflex::pipeline {
namespace {

// Lines between runs are handed on in portions, so that a long file without motion stays small.
constexpr std::size_t kMaxEventsOutsideRuns = 4096;
constexpr std::size_t kMaxWarnings = 1000;

bool stands_anywhere(const gcode::Event& event) {
  return event.kind == gcode::EventKind::passive || event.kind == gcode::EventKind::limits;
}

// ";unflex run" or ";unflex 1.2.3: …".
bool is_own_comment(std::string_view content) {
  if (!content.starts_with(emit::kComment)) {
    return false;
  }
  content.remove_prefix(emit::kComment.size());
  return content == " run" || content == " end" ||
         (content.size() > 1 && content[0] == ' ' && content[1] >= '0' && content[1] <= '9');
}

// What other programs take for the end of a line.
bool has_bare_return(std::string_view content) {
  const std::size_t at = content.find('\r');
  return at != std::string_view::npos &&
         content.find_first_not_of("\r \t", at) != std::string_view::npos;
}

// A letter that printers know and a number: enough to tell G-code from prose.
bool looks_like_command(std::string_view content) {
  const gcode::Command command = gcode::parse(content);
  return command.kind == gcode::CommandKind::traditional &&
         (command.letter == 'G' || command.letter == 'M' || command.letter == 'T');
}

}  // namespace

void count_kept_moves(const gcode::Event& event, Firmware firmware,
                      std::map<std::string, std::size_t>& kept) {
  if (gcode::compensable(event, firmware)) {
    return;
  }
  for (const gcode::Segment& segment : event.segments) {
    const std::string_view reason = gcode::kept_reason(segment, firmware);
    ++kept[std::string(reason.empty() ? "part of an arc that is kept" : reason)];
  }
}

PieceReader::PieceReader(std::istream& input, std::string name,
                         gcode::InterpreterOptions interpreter, planner::Limits limits,
                         planner::FirmwareConfig fixed)
    : lines_(input, std::move(name)),
      interpreter_(interpreter),
      planner_(planner::make_planner(limits, fixed)),
      firmware_(fixed.firmware) {}

Result<bool> PieceReader::next(Piece& piece) {
  gcode::Event event;
  for (;;) {
    const Result<bool> more = read_event(event);
    if (!more) {
      return more;
    }
    if (!*more) {
      break;
    }
    if (stands_anywhere(event)) {
      if (open_.is_run) {
        between_.push_back(std::move(event));
      } else {
        append(std::move(event));
      }
    } else {
      const bool for_run = gcode::compensable(event, firmware_);
      if (!open_.events.empty() && open_.is_run != for_run) {
        close(piece);
        open_.is_run = for_run;
        append(std::move(event));
        return true;
      }
      open_.is_run = for_run;
      append(std::move(event));
    }
    if (!open_.is_run && open_.events.size() >= kMaxEventsOutsideRuns) {
      close(piece);
      return true;
    }
  }
  if (!any_command_) {
    return fail(ErrorKind::input, {lines_.name(), 0},
                "there is no G-code command in it; give a file as the slicer wrote it");
  }
  if (open_.events.empty() && between_.empty()) {
    return false;
  }
  close(piece);
  return true;
}

Result<bool> PieceReader::read_event(gcode::Event& event) {
  gcode::Line line;
  const Result<bool> more = lines_.next(line);
  if (!more || !*more) {
    return more;
  }
  if (is_own_comment(line.content())) {
    return fail(ErrorKind::input, {lines_.name(), line.number},
                "this file was already compensated by unflex; give the file as it was sliced");
  }
  any_command_ = any_command_ || looks_like_command(line.content());
  if (!any_bare_return_ && has_bare_return(line.content())) {
    any_bare_return_ = true;
    warnings_.push_back({{lines_.name(), line.number},
                         "a carriage return without a line feed ends no line, neither here nor in "
                         "the printer: convert the file's line ends to LF"});
  }
  event = interpreter_.interpret(std::move(line));
  for (std::string& warning : event.warnings) {
    if (warnings_.size() < kMaxWarnings) {
      warnings_.push_back({{lines_.name(), event.line.number}, std::move(warning)});
    }
  }
  planner_->apply(event.limits);
  return true;
}

// Puts the event into the open piece, after the lines that turned out to stand between.
void PieceReader::append(gcode::Event event) {
  append_between();
  if (open_.is_run && open_.events.empty()) {
    // The move itself changes nothing of it.
    open_.start = emit::run_start(interpreter_.state(), planner_->limits());
  }
  std::size_t count = 0;
  for (const gcode::Segment& segment : event.segments) {
    count += planner_->add(segment) ? 1 : 0;
  }
  if (event.kind == gcode::EventKind::barrier) {
    planner_->stop();
  }
  open_.events.push_back(std::move(event));
  open_.move_counts.push_back(count);
}

void PieceReader::append_between() {
  for (gcode::Event& event : between_) {
    open_.events.push_back(std::move(event));
    open_.move_counts.push_back(0);
  }
  between_.clear();
}

// Hands out the open piece; the lines after a run's last move go to the next one.
void PieceReader::close(Piece& piece) {
  if (open_.events.empty()) {
    append_between();
  }
  planner_->stop();
  planner_->take(open_.moves);
  // Marlin leaves moves of a few steps to the next one.
  open_.is_run = open_.is_run && !open_.moves.empty();
  piece = std::exchange(open_, Piece{});
}

}  // namespace unflex::pipeline
