// Moves of the tool as lines of joints.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "translator.hpp"
#include "unflex/core/number.hpp"

namespace unflex::flow {
namespace {

using gcode::EventKind;
using gcode::kXYZ;

constexpr std::array<char, 3> kLetters = {'X', 'Y', 'Z'};
constexpr double kPerMinute = 60.0;

bool is_arc(const gcode::Command& command) { return command.number >= 2; }

// Whether a word is there twice, or a second command.
bool is_odd(const gcode::Command& command) {
  std::string seen;
  return std::ranges::any_of(command.words, [&](const gcode::Word& word) {
    const bool is_seen = seen.find(word.letter) != std::string::npos;
    seen += word.letter;
    return is_seen || std::string_view("GMT").find(word.letter) != std::string_view::npos;
  });
}

std::int64_t feed_scaled(const gcode::ModalState& state) {
  return to_scaled(kPerMinute * state.feed_mm_s, kFeedDecimals);
}

double length_mm(const ScaledJoints& from, const ScaledJoints& to) {
  double sum = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto way = static_cast<double>(to[i] - from[i]);
    sum += way * way;
  }
  return std::sqrt(sum) / power_of_ten(kJointDecimals);
}

// Words of E for the lines of a move that was cut. Their sum, or the last of them, is the word of
// the sliced line.
class CutE {
 public:
  CutE(const MotionText& motion, const gcode::ModalState& before)
      : is_reading_(before.e_is_absolute()) {
    const std::optional<double> end = parse_number(motion.e.value_or(""));
    if (!end) {
      return;
    }
    has_e_ = true;
    end_ = *end;
    const std::size_t point = std::min(motion.e->find('.'), motion.e->size() - 1);
    decimals_ = std::clamp(static_cast<int>(motion.e->size() - 1 - point), 5, 9);
    start_ = is_reading_ ? (before.position_mm[gcode::E] - before.base_mm[gcode::E]) /
                               before.filament_per_e_mm()
                         : 0.0;
  }

  // share: from the move's start to the line's end.
  [[nodiscard]] std::optional<std::string> word(double share) {
    if (!has_e_) {
      return std::nullopt;
    }
    const double reading = share < 1.0 ? start_ + share * (end_ - start_) : end_;
    const std::int64_t now = to_scaled(reading, decimals_);
    std::string text;
    append_scaled(text, is_reading_ ? now : now - written_, decimals_);
    written_ = now;
    return text;
  }

 private:
  bool is_reading_;
  int decimals_ = 0;
  double start_ = 0.0;
  double end_ = 0.0;
  bool has_e_ = false;
  std::int64_t written_ = 0;
};

}  // namespace

Status Translator::motion(const gcode::ModalState& before, std::string& text) {
  if (!is_arc(command_) && !command_.has_any("XYZ")) {
    return filament_alone(text);
  }
  if (Status checked = check_motion(); !checked) {
    return checked;
  }
  const bool knows_start = is_place_known();
  for (std::size_t i = 0; i < known_.size(); ++i) {
    known_[i] = known_[i] || (command_.has(kLetters[i]) && before.absolute_xyz);
  }
  if (!is_place_known()) {
    return wrong(fmt::format(
        "where the tool is has not been told since {}; let the first move behind it give X, Y and "
        "Z in absolute mode, or set kinematics.home_mm, where G28 leaves the tool",
        lost_by_));
  }
  if (!knows_start && (is_arc(command_) || !is_uniform(options_.machine))) {
    return wrong(
        fmt::format("this move begins at a place that has not been told since {}; home "
                    "with G28, and set kinematics.home_mm, where it leaves the tool",
                    lost_by_));
  }
  return move(before, knows_start, text);
}

Status Translator::check_motion() const {
  if (needs_home_) {
    return wrong(
        fmt::format("this line moves the tool, and the motors have been off since {}; "
                    "home with G28 before",
                    lost_by_));
  }
  if (is_odd(command_)) {
    return wrong("a second command, or a word given twice; give each its own line");
  }
  if (event_.line.has_bare_return()) {
    return wrong("a carriage return within the line; end each line with a line feed");
  }
  if (command_.line_number || command_.checksum) {
    return wrong(
        "the line has a number or a checksum, which another line must not have; write the file "
        "without them");
  }
  return {};
}

// Each line of the output has its own F, so a line without one may need the sliced one again.
Status Translator::filament_alone(std::string& text) {
  if (moves_tool(event_)) {
    return wrong(
        "this line becomes the firmware's own retraction with a hop of Z, which would move a "
        "joint; switch the hop off (M207 Z0), or M209");
  }
  const std::int64_t feed = feed_scaled(sliced_.state());
  if (event_.kind != EventKind::move || command_.has('F') ||
      (feed == feed_scaled(written_.state()) && !tells_feed_)) {
    text += event_.line.text;
    return {};
  }
  if (command_.line_number || command_.checksum || is_odd(command_)) {
    return check_motion();
  }
  text += with_feed(event_.line, feed);
  return {};
}

Status Translator::move(const gcode::ModalState& before, bool knows_start, std::string& text) {
  std::vector<gcode::Segment> segments = event_.segments;
  if (segments.empty()) {
    segments.emplace_back();
    segments.front().start_mm = segments.front().end_mm = sliced_.state().position_mm;
  }
  if (!knows_start) {
    // Where the move comes from is not known, so its end alone can be looked at.
    for (const gcode::Axis axis : kXYZ) {
      segments.front().start_mm[axis] = segments.front().end_mm[axis];
    }
  }
  const auto pieces = tool_lines(options_.machine, segments, options_.tolerance_mm);
  if (!pieces) {
    return wrong(
        fmt::format("{}; place the print elsewhere, or correct the keys of kinematics if "
                    "they are wrong",
                    pieces.error()));
  }
  append_lines(before, knows_start, *pieces, text);
  ++moves_;
  lines_ += pieces->size();
  return {};
}

void Translator::append_lines(const gcode::ModalState& before, bool knows_start,
                              const std::vector<ToolLine>& pieces, std::string& text) {
  const MotionText motion = motion_text(event_.line, is_arc(command_));
  const bool is_cut = pieces.size() > 1;
  CutE cut_e(motion, before);
  std::int64_t feed = feed_scaled(written_.state());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const ToolLine& piece = pieces[i];
    const ScaledJoints to = scaled_joints(piece.end_joints_mm);
    const std::int64_t wanted = feed_of(piece, to, knows_start);
    append_motion(text, motion, to, is_cut ? cut_e.word(piece.share_of_e) : motion.e,
                  wanted != feed || tells_feed_ ? std::optional(wanted) : std::nullopt);
    text += i == 0 ? motion.comment : std::string_view{};
    const bool is_last = i + 1 == pieces.size();
    text += motion.ending.empty() && !is_last ? "\n" : motion.ending;
    feed = wanted;
    tells_feed_ = false;
    joints_ = to;
  }
}

// The line takes as long as the sliced one at constant speed: |Δq| / F_q = |Δp| / F. Behind an
// unknown place it takes at least that long: |Δp| ≤ ‖J⁻¹‖ |Δq|.
std::int64_t Translator::feed_of(const ToolLine& piece, const ScaledJoints& to,
                                 bool knows_start) const {
  double factor = 1.0;
  if (!knows_start) {
    factor = 1.0 / kinematics::norm_of_inverse(jacobian(options_.machine, piece.end_mm));
  } else if (const double way_mm = length_mm(joints_, to); way_mm > 0.0 && piece.length_mm > 0.0) {
    factor = way_mm / piece.length_mm;
  }
  const double feed_mm_min = kPerMinute * sliced_.state().feed_mm_s * factor;
  return std::max<std::int64_t>(to_scaled(feed_mm_min, kFeedDecimals), 1);
}

}  // namespace unflex::flow
