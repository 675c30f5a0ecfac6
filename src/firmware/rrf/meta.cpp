#include <algorithm>
#include <array>

#include "characters.hpp"
#include "unflex/gcode/rrf_meta.hpp"

namespace unflex::gcode {
namespace {

constexpr std::array<std::string_view, 5> kHarmless = {"echo", "global", "set", "skip", "var"};
constexpr std::array<std::string_view, 4> kBlocks = {"elif", "else", "if", "while"};
constexpr std::array<std::string_view, 3> kJumps = {"abort", "break", "continue"};
// Labels of Slic3r's family, Cura, Simplify3D and IdeaMaker.
constexpr std::array<std::string_view, 5> kObjectLabels = {"MESH", "PRINTING", "printing object",
                                                           "process", "stop printing object"};

template <class List>
bool contains(const List& list, std::string_view word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

}  // namespace

MetaCommand meta_command(std::string_view content) {
  const std::size_t first = content.find_first_not_of(" \t");
  if (first == std::string_view::npos) {
    return MetaCommand::none;
  }
  content.remove_prefix(first);
  const auto last = std::find_if_not(content.begin(), content.end(), is_lower);
  if (last != content.end() &&
      std::string_view(" \t{\"(\r").find(*last) == std::string_view::npos) {
    return MetaCommand::none;
  }
  const std::string_view word = content.substr(0, static_cast<std::size_t>(last - content.begin()));
  if (contains(kHarmless, word)) {
    return MetaCommand::harmless;
  }
  if (contains(kBlocks, word)) {
    return MetaCommand::block;
  }
  return contains(kJumps, word) ? MetaCommand::jump : MetaCommand::none;
}

std::size_t indentation(std::string_view content) {
  constexpr std::size_t kTab = 4;
  std::size_t indent = 0;
  for (const char c : content) {
    if (c == ' ') {
      ++indent;
    } else if (c == '\t') {
      indent += kTab - indent % kTab;
    } else {
      break;
    }
  }
  return indent;
}

bool has_expression(std::string_view content) {
  bool quoted = false;
  for (const char c : content) {
    if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == ';') {
      return false;
    } else if (!quoted && c == '{') {
      return true;
    }
  }
  return false;
}

bool reads_machine(std::string_view content) {
  constexpr std::array<std::string_view, 3> kParts = {"move.", "state.", "tools["};
  return std::ranges::any_of(
      kParts, [&](std::string_view part) { return content.find(part) != std::string_view::npos; });
}

bool labels_object(std::string_view comment) {
  const std::size_t first = comment.find_first_not_of(' ');
  if (first == std::string_view::npos) {
    return false;
  }
  comment.remove_prefix(first);
  return std::any_of(kObjectLabels.begin(), kObjectLabels.end(), [&](std::string_view label) {
    return comment.substr(0, label.size()) == label &&
           (comment.size() == label.size() ||
            (!is_letter(comment[label.size()]) && comment[label.size()] != '_'));
  });
}

}  // namespace unflex::gcode
