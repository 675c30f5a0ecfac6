#include "joint_line.hpp"

#include <algorithm>
#include <cctype>

#include "unflex/core/number.hpp"

namespace unflex::flow {
namespace {

constexpr std::string_view kBlanks = " \t";

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

char upper(char c) { return static_cast<char>(std::toupper(static_cast<unsigned char>(c))); }

// Where the code of the line ends: behind its last word. Comments in parentheses do not occur,
// since no line of motion with them is taken.
std::size_t end_of_code(std::string_view content) {
  const std::size_t comment = std::min(content.find_first_of(";#"), content.size());
  const std::size_t last = content.substr(0, comment).find_last_not_of(kBlanks);
  return last == std::string_view::npos ? 0 : last + 1;
}

std::string without_blanks(std::string_view text) {
  std::string result(text);
  std::erase_if(result, [](char c) { return kBlanks.find(c) != std::string_view::npos; });
  return result;
}

void append_word(std::string& text, char letter, std::int64_t scaled, int decimals) {
  text += ' ';
  text += letter;
  append_scaled(text, scaled, decimals);
}

}  // namespace

ScaledJoints scaled_joints(const std::array<double, 3>& joints_mm) {
  ScaledJoints result{};
  std::ranges::transform(joints_mm, result.begin(),
                         [](double value) { return to_scaled(value, kJointDecimals); });
  return result;
}

MotionText motion_text(const gcode::Line& line, bool is_arc) {
  const std::string_view content = line.content();
  const std::size_t end = end_of_code(content);
  MotionText motion;
  motion.comment = content.substr(end);
  motion.ending = std::string_view(line.text).substr(content.size());
  std::size_t at = content.find_first_not_of(kBlanks);
  bool is_first = true;
  while (at < end) {
    const auto* const next =
        std::find_if(content.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                     content.begin() + static_cast<std::ptrdiff_t>(end), is_letter);
    const std::size_t behind = static_cast<std::size_t>(next - content.begin());
    const std::string_view word = content.substr(at, behind - at);
    const char letter = upper(word.front());
    constexpr std::string_view kReplaced = "XYZF";
    constexpr std::string_view kOfArcs = "IJKRP";
    if (is_first) {
      motion.command = is_arc ? "G1" : word.substr(0, word.find_last_not_of(kBlanks) + 1);
    } else if (letter == 'E') {
      motion.e = without_blanks(word.substr(1));
    } else if (kReplaced.find(letter) == std::string_view::npos &&
               !(is_arc && kOfArcs.find(letter) != std::string_view::npos)) {
      motion.others += ' ';
      motion.others += without_blanks(word);
    }
    is_first = false;
    at = behind;
  }
  return motion;
}

void append_motion(std::string& text, const MotionText& motion, const ScaledJoints& joints,
                   const std::optional<std::string>& e, std::optional<std::int64_t> feed_scaled) {
  text += motion.command;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    append_word(text, "XYZ"[i], joints[i], kJointDecimals);
  }
  text += motion.others;
  if (e) {
    text += " E" + *e;
  }
  if (feed_scaled) {
    append_word(text, 'F', *feed_scaled, kFeedDecimals);
  }
}

std::string with_feed(const gcode::Line& line, std::int64_t feed_scaled) {
  const std::size_t end = end_of_code(line.content());
  std::string text = line.text.substr(0, end);
  append_word(text, 'F', feed_scaled, kFeedDecimals);
  return text + line.text.substr(end);
}

std::string with_command(const gcode::Line& line, std::string_view command) {
  const std::string_view content = line.content();
  const std::size_t first = content.find_first_not_of(kBlanks);
  return line.text.substr(0, first) + std::string(command) + line.text.substr(end_of_code(content));
}

}  // namespace unflex::flow
