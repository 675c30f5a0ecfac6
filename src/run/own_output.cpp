#include "unflex/run/own_output.hpp"

#include <string_view>

#include "unflex/core/own_marks.hpp"

namespace unflex::run {
namespace {

// One of the marks, or the line that names the version: ";unflex 1.2.3: …".
bool is_own_comment(std::string_view content) {
  const auto is_run = [&] {
    const std::string_view words = content.substr(kRunMark.size());
    return words.empty() || words.starts_with(kLeadInWord) || words == kFreeTimingWord;
  };
  if (content == kRunEndMark || (content.starts_with(kRunMark) && is_run())) {
    return true;
  }
  if (!content.starts_with(kOwnMark)) {
    return false;
  }
  content.remove_prefix(kOwnMark.size());
  return content.size() > 1 && content[0] == ' ' && content[1] >= '0' && content[1] <= '9';
}

}  // namespace

Error compensated_already(const std::string& file, std::size_t line) {
  return {ErrorKind::input,
          {file, line},
          "this file was already compensated by unflex; give the file as it was sliced, and let a "
          "slicer run unflex once"};
}

Status check_as_sliced(const gcode::Line& line, const std::string& file) {
  if (line.content().starts_with(kJointsMark)) {
    return fail(
        ErrorKind::input, {file, line.number},
        "this file was already translated by unflex, and its places are of joints; give the "
        "file as it was sliced");
  }
  if (!is_own_comment(line.content())) {
    return {};
  }
  return tl::unexpected(compensated_already(file, line.number));
}

Result<std::optional<std::size_t>> own_line(std::istream& stream, const std::string& file) {
  gcode::LineReader lines(stream, file);
  gcode::Line line;
  std::optional<std::size_t> found;
  while (!found) {
    const Result<bool> more = lines.next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      break;
    }
    if (is_own_comment(line.content())) {
      found = line.number;
    }
  }
  stream.clear();
  stream.seekg(0);
  return found;
}

}  // namespace unflex::run
