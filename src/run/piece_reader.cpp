#include "unflex/run/piece_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/compensable.hpp"
#include "unflex/gcode/tool_check.hpp"
#include "unflex/run/own_output.hpp"
#include "unflex/verify/endless.hpp"

namespace unflex::run {
namespace {

// Lines between runs are handed on in portions, so that a long file without motion stays small.
constexpr std::size_t kMaxEventsOutsideRuns = 4096;
// In a run, lines without motion are held until it is known what follows. No print has this many in
// a row, or in the part of a run that is held. If there are more, the run ends there as if the
// machine stopped.
constexpr std::size_t kMostInARow = 20'000;
constexpr std::size_t kMostInARun = 400'000;
constexpr std::size_t kMaxWarnings = 1000;
constexpr std::size_t kMostSpareEvents = 10'000;
constexpr std::size_t kUsualEvents = 8;
// Runs up to this long are handled as a whole, so that they can be kept.
constexpr double kWhole_s = 60.0;
// Longer runs are split into parts of at least kPart_s. A part ends at a `Border`; these are about
// kBorder_s apart.
constexpr double kPart_s = 20.0;
constexpr double kBorder_s = 0.5;
// A part ends where velocity changes by no more than kSmooth_mm_s. If there is no such border, the
// part grows up to about kMost_s or kMostMoves.
constexpr double kSmooth_mm_s = 3.0;
constexpr double kMost_s = 1800.0;
constexpr std::size_t kMostMoves = 100'000;
// A part gets the moves around it that take this long.
constexpr double kAround_s = 0.3;
// How many new borders come before the reader looks again whether the run is long enough to be
// split.
constexpr std::size_t kBordersPerLook = 8;

// The change of velocity from the previous move to this one.
double turn_before(const std::vector<planner::PlannedMove>& moves, std::size_t move) {
  const planner::PlannedMove& from = moves[move - 1];
  const planner::PlannedMove& to = moves[move];
  return to.start_v_mm_s * distance(xy_of(from.direction), xy_of(to.direction));
}

// The first moves that take kAround_s.
std::vector<planner::PlannedMove> first_of(const std::vector<planner::PlannedMove>& moves) {
  double duration_s = 0.0;
  auto last = moves.begin();
  while (last != moves.end() && duration_s < kAround_s) {
    duration_s += last->duration_s();
    ++last;
  }
  return {moves.begin(), last};
}

// Removes the values from `first` on and returns them.
template <class Value>
std::vector<Value> split_off(std::vector<Value>& values, std::size_t first) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  std::vector<Value> rest(std::make_move_iterator(begin), std::make_move_iterator(values.end()));
  values.erase(begin, values.end());
  return rest;
}

bool stands_anywhere(const gcode::Event& event) {
  return event.kind == gcode::EventKind::passive || event.kind == gcode::EventKind::limits;
}

// A letter that printers know and a number: enough to tell G-code from prose.
bool looks_like_command(std::string_view content) {
  const gcode::Command command = gcode::parse(content);
  return command.kind == gcode::CommandKind::traditional &&
         (command.letter == 'G' || command.letter == 'M' || command.letter == 'T');
}

}  // namespace

std::string_view kept_move_reason(const gcode::Segment& segment, Firmware firmware) {
  const std::string_view reason = gcode::kept_reason(segment, firmware);
  return reason.empty() ? "part of an arc that is kept" : reason;
}

void count_kept_moves(const gcode::Event& event, Firmware firmware,
                      std::map<std::string, std::size_t>& kept) {
  if (gcode::compensable(event, firmware)) {
    return;
  }
  for (const gcode::Segment& segment : event.segments) {
    ++kept[std::string(kept_move_reason(segment, firmware))];
  }
}

PieceReader::PieceReader(std::istream& input, std::string name,
                         gcode::InterpreterOptions interpreter, planner::Limits limits,
                         planner::FirmwareConfig fixed, verify::TravelLimits travel)
    : lines_(input, std::move(name)),
      interpreter_(interpreter),
      planner_(planner::make_planner(limits, fixed)),
      firmware_(fixed.firmware),
      travel_(travel) {}

Result<bool> PieceReader::next(Piece& piece) {
  recycle(piece);
  const Result<bool> more = cut(piece);
  if (more && *more) {
    if (const planner::PlannedMove* const move = verify::endless(piece.moves)) {
      return tl::unexpected(verify::endless_move(*move, lines_.name()));
    }
    warn_of_long_moves(piece.moves);
  }
  if (more && !*more) {
    warn_of_travel();
  }
  return more;
}

Result<bool> PieceReader::cut(Piece& piece) {
  for (;;) {
    gcode::Event event;
    take_spare(event);
    const Result<bool> more = read_event(event);
    if (!more) {
      return more;
    }
    if (!*more) {
      break;
    }
    if (stands_anywhere(event)) {
      if (open_.is_run && (between_.size() >= kMostInARow || still_lines_ >= kMostInARun)) {
        open_.cut_off = true;
        after_cut_ = true;
        close(piece);
        append(std::move(event));
        return true;
      }
      if (open_.is_run) {
        between_.push_back(std::move(event));
        ++still_lines_;
      } else {
        append(std::move(event));
      }
    } else {
      const bool for_run = gcode::compensable(event, firmware_);
      if (!open_.events.empty() && (open_.is_run != for_run || open_.tool != tool_)) {
        close(piece);
        open_.is_run = for_run;
        append(std::move(event));
        return true;
      }
      open_.is_run = for_run;
      append(std::move(event));
      if (for_run && split(piece)) {
        return true;
      }
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

// Empties the piece and collects the storage of its lines for reuse. If pieces kept their storage,
// all would grow to the size of the largest.
void PieceReader::recycle(Piece& piece) {
  if (!piece.events.empty() && spare_events_ + piece.events.size() <= kMostSpareEvents) {
    spare_events_ += piece.events.size();
    spare_.push_back(std::move(piece.events));
  }
  piece = {};
}

void PieceReader::take_spare(gcode::Event& event) {
  if (!spare_.empty()) {
    std::vector<gcode::Event>& events = spare_.back();
    event = std::move(events.back());
    events.pop_back();
    --spare_events_;
    if (events.empty()) {
      spare_.pop_back();
    }
  }
}

void PieceReader::read_line(gcode::Event& event) {
  interpreter_.interpret(event);
  for (std::string& warning : event.warnings) {
    warn(event.line.number, std::move(warning));
  }
  if (event.kind != gcode::EventKind::move) {
    planner_->apply(event);
  }
}

Result<bool> PieceReader::read_event(gcode::Event& event) {
  gcode::Line& line = event.line;
  if (approached_) {
    line = std::move(*approached_);
    approached_.reset();
    read_line(event);
    travel_.add(event);
    return true;
  }
  const Result<bool> more = lines_.next(line);
  if (!more || !*more) {
    return more;
  }
  if (Status sliced = check_as_sliced(line, lines_.name()); !sliced) {
    return tl::unexpected(sliced.error());
  }
  any_command_ = any_command_ || looks_like_command(line.content());
  if (const std::optional<std::string_view> name = gcode::feature_name(line.content())) {
    feature_ = gcode::feature_by_name(*name);
  }
  // For Marlin a carriage return ends the line, and the interpreter warns.
  if (!spec_of(firmware_).reading.return_ends_line && line.has_bare_return()) {
    warn(line.number,
         "a carriage return without a line feed ends no line, neither here nor in the printer: "
         "convert the file's line ends to LF");
  }
  if (std::optional<std::string> approach = interpreter_.approach(line)) {
    approached_ = std::exchange(line, {std::move(*approach), line.number});
    read_line(event);
    event.added = true;
    return true;
  }
  read_line(event);
  const std::vector<int>& tools = interpreter_.options().tools;
  if (Status told = gcode::check_tool(event, tools, lines_.name()); !told) {
    return tl::unexpected(told.error());
  }
  if (event.tool && !tools.empty()) {
    tool_ = *event.tool;
  }
  travel_.add(event);
  if (Status mode = extrusion_mode_.add(event, interpreter_.state(), lines_.name()); !mode) {
    return tl::unexpected(mode.error());
  }
  return true;
}

void PieceReader::warn(std::size_t line, std::string message) {
  if (warnings_.size() < kMaxWarnings) {
    warnings_.push_back({{lines_.name(), line}, std::move(message)});
    return;
  }
  if (unlisted_warnings_++ == 0) {
    warnings_.emplace_back().place.file = lines_.name();
  }
  warnings_.back().message = fmt::format("{} more warnings are not listed", unlisted_warnings_);
}

// Warns of the moves that leave the travel, once, at the first one's place among the warnings.
void PieceReader::warn_of_travel() {
  if (std::optional<Diagnostic> warning =
          std::exchange(travel_, TravelCheck({})).warning(lines_.name())) {
    const auto later = std::ranges::find_if(warnings_, [&](const Diagnostic& other) {
      return other.place.line > warning->place.line || other.place.line == 0;
    });
    warnings_.insert(later, std::move(*warning));
  }
}

// Warns of moves that take so long that most of them are a mistake.
void PieceReader::warn_of_long_moves(const std::vector<planner::PlannedMove>& moves) {
  constexpr double kLong_s = 600.0;
  for (const planner::PlannedMove& move : moves) {
    if (move.duration_s() > kLong_s) {
      warn(move.segment.line, fmt::format("this move takes {:.0f} minutes; check its F, its length "
                                          "and its filament",
                                          move.duration_s() / 60.0));
    }
  }
}

// Puts the event into the open piece, after the lines held in between_.
void PieceReader::append(gcode::Event&& event) {
  if (open_.events.empty()) {
    open_.from_mm = machine_mm_;
    open_.tool = tool_;
    open_.events.reserve(kUsualEvents);
    open_.move_counts.reserve(kUsualEvents);
    open_.features.reserve(kUsualEvents);
  }
  append_between();
  if (!open_.is_run || open_.events.empty()) {
    open_.pressure_advance = interpreter_.state().pressure_advance;
  }
  if (open_.is_run && open_.events.empty()) {
    // The event is a move, so it has changed nothing of this state.
    open_.start = emit::run_start(firmware_, interpreter_.state(), planner_->limits());
    open_.cut_off = after_cut_;
  }
  after_cut_ = after_cut_ && stands_anywhere(event);
  if (open_.is_run) {
    mark_border(event);
  }
  std::size_t count = 0;
  for (const gcode::Segment& segment : event.segments) {
    if (planner_->add(segment)) {
      ++count;
      machine_mm_ = segment.end_mm;
    }
  }
  if (event.kind == gcode::EventKind::barrier) {
    planner_->stop();
  }
  open_.events.push_back(std::move(event));
  open_.move_counts.push_back(count);
  open_.features.push_back(feature_);
}

void PieceReader::append_between() {
  for (gcode::Event& event : between_) {
    open_.events.push_back(std::move(event));
    open_.move_counts.push_back(0);
    open_.features.push_back(feature_);
  }
  between_.clear();
}

// Notes a border before the move that is about to be added, if the last border is long ago.
void PieceReader::mark_border(const gcode::Event& event) {
  if (since_border_s_ >= kBorder_s) {
    since_border_s_ = 0.0;
    ++borders_since_look_;
    borders_.push_back({open_.events.size(), open_.moves.size() + planner_->pending(),
                        emit::run_start(firmware_, interpreter_.state(), planner_->limits())});
  }
  for (const gcode::Segment& segment : event.segments) {
    since_border_s_ += segment.length_xy_mm() / segment.feed_mm_s;
  }
}

// The border at which the open part is to end; nullopt: none yet. The part must be long enough, and
// the plan final until kAround_s after the border. The first border that is no corner is taken. If
// all are corners, the least sharp is taken once the part is very long.
std::optional<std::size_t> PieceReader::border_to_split_at() const {
  const std::vector<planner::PlannedMove>& moves = open_.moves;
  const double total_s = planner::duration_s(moves);
  if (total_s < (open_.before.empty() ? kWhole_s : kPart_s + kAround_s)) {
    return std::nullopt;
  }
  std::optional<std::size_t> best;
  double least_turn_mm_s = std::numeric_limits<double>::infinity();
  double end_s = 0.0;
  std::size_t move = 0;
  for (std::size_t i = 0; i < borders_.size() && borders_[i].move < moves.size(); ++i) {
    for (; move < borders_[i].move; ++move) {
      end_s += moves[move].duration_s();
    }
    if (total_s - end_s < kAround_s) {
      break;
    }
    if (end_s < kPart_s) {
      continue;
    }
    const double turn_mm_s = turn_before(moves, move);
    if (turn_mm_s <= kSmooth_mm_s) {
      return i;
    }
    if (turn_mm_s < least_turn_mm_s) {
      least_turn_mm_s = turn_mm_s;
      best = i;
    }
  }
  return total_s > kMost_s || moves.size() > kMostMoves ? best : std::nullopt;
}

// Hands out a part of the open run if the run is long by now.
bool PieceReader::split(Piece& piece) {
  if (borders_since_look_ < kBordersPerLook) {
    return false;
  }
  borders_since_look_ = 0;
  planner_->take(open_.moves);
  const std::optional<std::size_t> chosen = border_to_split_at();
  if (!chosen) {
    return false;
  }
  Border border = std::move(borders_[*chosen]);
  borders_.erase(borders_.begin(), borders_.begin() + static_cast<std::ptrdiff_t>(*chosen) + 1);
  for (Border& later : borders_) {
    later.event -= border.event;
    later.move -= border.move;
  }

  Piece rest;
  rest.is_run = true;
  rest.start = std::move(border.start);
  rest.events = split_off(open_.events, border.event);
  rest.move_counts = split_off(open_.move_counts, border.event);
  rest.features = split_off(open_.features, border.event);
  rest.moves = split_off(open_.moves, border.move);
  const auto before = planner::last_moves(open_.moves, kAround_s);
  rest.before.assign(before.begin(), before.end());
  open_.after = first_of(rest.moves);
  still_lines_ = static_cast<std::size_t>(std::ranges::count(rest.move_counts, 0U));
  piece = std::exchange(open_, std::move(rest));
  return true;
}

// Hands out the open piece; the lines after a run's last move go to the next piece.
void PieceReader::close(Piece& piece) {
  if (open_.events.empty()) {
    append_between();
  }
  planner_->stop();
  planner_->take(open_.moves);
  // Marlin leaves a move of a few steps to the next one, so a run may have no planned move.
  open_.is_run = open_.is_run && !open_.moves.empty();
  piece = std::exchange(open_, Piece{});
  still_lines_ = 0;
  borders_.clear();
  since_border_s_ = 0.0;
}

}  // namespace unflex::run
