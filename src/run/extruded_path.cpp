#include "unflex/run/extruded_path.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "unflex/core/error.hpp"
#include "unflex/gcode/compensable.hpp"
#include "unflex/gcode/unknown_command.hpp"
#include "unflex/report/format.hpp"

namespace unflex::run {
namespace {

// If a smaller share of the path is compensated than kEnough, a warning names kNamedReasons of the
// reasons.
constexpr double kEnough = 0.95;
constexpr std::size_t kNamedReasons = 3;
// A command that costs less path than this is not worth a warning.
constexpr double kLeast_mm = 0.1;
// If a file has less extruded path than this, the share says nothing.
constexpr double kLeastFile_mm = 100.0;

std::vector<std::pair<double, std::string>> largest(const std::map<std::string, double>& kept_mm) {
  std::vector<std::pair<double, std::string>> reasons;
  for (const auto& [reason, length_mm] : kept_mm) {
    reasons.emplace_back(length_mm, reason);
  }
  std::ranges::stable_sort(reasons, std::ranges::greater{},
                           [](const auto& reason) { return reason.first; });
  reasons.resize(std::min(reasons.size(), kNamedReasons));
  return reasons;
}

}  // namespace

void ExtrudedPath::keep(const Piece& piece) {
  for (const gcode::Event& event : piece.events) {
    keep_moves(piece, event);
    note_command(event);
  }
}

void ExtrudedPath::compensate(const Piece& piece) {
  lost_by_.reset();
  for (const gcode::Event& event : piece.events) {
    for (const gcode::Segment& segment : event.segments) {
      const double length_mm = segment.extruding() ? segment.length_xy_mm() : 0.0;
      path_.total_mm += length_mm;
      path_.compensated_mm += length_mm;
    }
  }
}

void ExtrudedPath::keep_moves(const Piece& piece, const gcode::Event& event) {
  if (event.lost_path_mm > 0.0) {
    path_.total_mm += event.lost_path_mm;
    path_.kept_mm["line not understood"] += event.lost_path_mm;
  }
  for (const gcode::Segment& segment : event.segments) {
    const std::string_view reason =
        piece.is_run ? "run left as sliced" : kept_move_reason(segment, firmware_);
    const double length_mm = segment.extruding() ? segment.length_xy_mm() : 0.0;
    if (length_mm > 0.0) {
      path_.total_mm += length_mm;
      path_.kept_mm[std::string(reason)] += length_mm;
    }
    if (segment.start_known) {
      lost_by_.reset();
    } else if (lost_by_) {
      ++unknown_[*lost_by_].moves_kept;
      unknown_[*lost_by_].kept_mm += length_mm;
    }
  }
}

void ExtrudedPath::note_command(const gcode::Event& event) {
  if (!event.position_lost) {
    return;
  }
  lost_by_.reset();
  std::string command = gcode::unknown_command(event, firmware_);
  if (command.empty()) {
    return;
  }
  const auto [place, is_new] = places_.try_emplace(command, unknown_.size());
  if (is_new) {
    unknown_.push_back({std::move(command), 0, event.line.number, 0, 0.0});
  }
  ++unknown_[place->second].count;
  lost_by_ = place->second;
}

std::vector<std::string> remarks(const report::ExtrudedPath& path,
                                 const std::vector<report::UnknownCommand>& unknown,
                                 const std::string& input_name) {
  std::vector<std::string> remarks;
  for (const report::UnknownCommand& command : unknown) {
    if (command.kept_mm < kLeast_mm) {
      continue;
    }
    remarks.push_back(to_string(Diagnostic{
        {input_name, command.first_line},
        fmt::format("{} is not known to unflex and may move the machine: {} in the "
                    "print, {} and {:.1f} mm of extruded path behind it stay as sliced",
                    command.command,
                    command.count == 1 ? "once" : fmt::format("{} times", command.count),
                    command.moves_kept == 1 ? std::string("one move")
                                            : fmt::format("{} moves", command.moves_kept),
                    command.kept_mm)}));
  }
  if (path.total_mm >= kLeastFile_mm && path.compensated_share() < kEnough) {
    std::string reasons;
    for (const auto& [length_mm, reason] : largest(path.kept_mm)) {
      reasons += fmt::format("{}{:.0f} mm: {}", reasons.empty() ? "" : ", ", length_mm, reason);
    }
    Diagnostic low;
    low.place.file = input_name;
    low.message = fmt::format("only {} of the extruded path is compensated ({})",
                              report::share_text(path.compensated_share()), reasons);
    remarks.push_back(to_string(low));
  }
  return remarks;
}

}  // namespace unflex::run
