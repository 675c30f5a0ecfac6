#include "line_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "unflex/gcode/time_note.hpp"

namespace unflex::verify {
namespace {

// Both files round filament.
constexpr double kPushedTolerance_mm = 0.01;
// Outside compensated runs the base rests at the rounded end of its path.
constexpr double kRestTolerance_mm = 1e-4 + 1e-9;

// Firmware ignores blank lines, and unflex drops them from binary G-code.
bool is_blank(const gcode::Line& line) {
  return line.content().find_first_not_of(" \t\r") == std::string_view::npos;
}

std::string_view text_end(const gcode::Line& line) {
  return std::string_view(line.text).substr(line.content().size());
}

}  // namespace

bool same_line(const gcode::Line& input, const gcode::Line& output) {
  const std::string_view end = text_end(input);
  return gcode::same_but_for_times(input.content(), output.content()) &&
         (end.empty() || end == text_end(output) || (end == "\r\n" && text_end(output) == "\n"));
}

// The next line of the current run that has to be compared.
PlacedLine* LineCheck::front(Replay& file) const {
  std::deque<PlacedLine>& lines = file.lines();
  while (!lines.empty() && lines.front().section <= file.section().id) {
    const bool replaced = lines.front().motion && output_->section().compensated;
    if (!replaced && !is_blank(lines.front().line)) {
      return &lines.front();
    }
    lines.pop_front();
  }
  return nullptr;
}

void LineCheck::compare(bool complete, double place_tolerance_mm) {
  place_tolerance_mm_ = place_tolerance_mm;
  for (;;) {
    const PlacedLine* const input = front(*input_);
    const PlacedLine* const output = front(*output_);
    const bool is_here =
        output != nullptr ? input != nullptr && same_line(input->line, output->line) : !complete;
    if (input != nullptr && !is_here && ahead_.is_awaited(input->line)) {
      ahead_.arrive();
      input_->lines().pop_front();
    } else if (input != nullptr && output != nullptr) {
      compare(*input, *output);
    } else if (complete && input != nullptr) {
      lost(*input);
      input_->lines().pop_front();
    } else if (complete && output != nullptr) {
      if (!is_known_addition(output->line.content(), input_->firmware()) &&
          !ahead_.takes(output->line)) {
        unknown(*output);
      }
      output_->lines().pop_front();
    } else {
      return;
    }
  }
}

// Lines of the forms that unflex adds may stand in the sliced file as well. Such a line is the
// sliced file's own if it stands in the same place; otherwise it was added. A line that asks for a
// temperature ahead may equal the sliced file's next line in the run. The filament tells them
// apart: less has come out at the line ahead.
void LineCheck::compare(const PlacedLine& input, const PlacedLine& output) {
  const bool same = same_line(input.line, output.line);
  const bool placed = same && at_same_place(input, output);
  const bool is_addition = is_known_addition(output.line.content(), input_->firmware());
  const auto is_ahead = [&] {
    return output.pushed_mm <= input.pushed_mm + kPushedTolerance_mm && ahead_.takes(output.line);
  };
  if (placed || (same && !is_addition && !is_ahead())) {
    match(input, output);
    input_->lines().pop_front();
  } else if (!same && !is_addition && !ahead_.takes(output.line)) {
    resynchronise(output);
  }
  output_->lines().pop_front();
}

bool LineCheck::at_same_place(const PlacedLine& input, const PlacedLine& output) const {
  const double tolerance = output_->section().compensated ? place_tolerance_mm_ : kRestTolerance_mm;
  return distance(output.place_mm, input.place_mm) <= tolerance;
}

void LineCheck::pass(const Section& input, const Section& output) {
  if (input.kind != SectionKind::end) {
    pass(input.line, input.moves_by_itself, output.line.number);
  } else if (std::optional<std::string> wrong = ahead_.end()) {
    violations_->in_output(output.line.number, std::move(*wrong));
  }
}

void LineCheck::pass(const gcode::Line& line, bool loses_place, std::size_t output_line) {
  if (std::optional<std::string> wrong = ahead_.pass(line, loses_place)) {
    violations_->in_output(output_line, std::move(*wrong));
  }
}

void LineCheck::match(const PlacedLine& input, const PlacedLine& output) {
  pass(input.line, /*loses_place=*/false, output.line.number);
  if (!at_same_place(input, output)) {
    violations_->in_output(
        output.line.number,
        fmt::format("'{}' moved along the path by {:.3f} mm (line {} of the sliced file)",
                    output.line.content(), distance(output.place_mm, input.place_mm),
                    input.line.number));
  }
}

// The output's line is not the expected one. Either the expected line and perhaps more are lost, or
// the output's line does not belong here.
void LineCheck::resynchronise(const PlacedLine& output) {
  std::deque<PlacedLine>& lines = input_->lines();
  const auto found = std::find_if(lines.begin(), lines.end(), [&](const PlacedLine& input) {
    return input.section <= input_->section().id && same_line(input.line, output.line);
  });
  if (found == lines.end()) {
    unknown(output);
    return;
  }
  while (front(*input_) != &*found) {
    lost(*front(*input_));
    lines.pop_front();
  }
  match(*found, output);
  lines.pop_front();
}

void LineCheck::lost(const PlacedLine& input) {
  violations_->in_input(input.line.number,
                        fmt::format("line '{}' is lost or changed", input.line.content()));
}

void LineCheck::unknown(const PlacedLine& output) {
  violations_->in_output(
      output.line.number,
      fmt::format("line '{}' is neither the sliced file's nor one that unflex adds",
                  output.line.content()));
}

}  // namespace unflex::verify
