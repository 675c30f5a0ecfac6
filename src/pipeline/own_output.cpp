#include "own_output.hpp"

#include <string_view>

#include "unflex/core/own_marks.hpp"

namespace unflex::pipeline {
namespace {

// One of the marks, or the line that names the version: ";unflex 1.2.3: …".
bool is_own_comment(std::string_view content) {
  if (content == kRunMark || content == kRunEndMark ||
      (content.starts_with(kRunMark) && content.substr(kRunMark.size()).starts_with(kLeadInWord))) {
    return true;
  }
  if (!content.starts_with(kOwnMark)) {
    return false;
  }
  content.remove_prefix(kOwnMark.size());
  return content.size() > 1 && content[0] == ' ' && content[1] >= '0' && content[1] <= '9';
}

}  // namespace

Status check_as_sliced(const gcode::Line& line, const std::string& file) {
  if (!is_own_comment(line.content())) {
    return {};
  }
  return fail(ErrorKind::input, {file, line.number},
              "this file was already compensated by unflex; give the file as it was sliced, and "
              "let a slicer run unflex once");
}

}  // namespace unflex::pipeline
