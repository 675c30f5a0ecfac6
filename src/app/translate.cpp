#include "translate.hpp"

#include <fmt/core.h>

#include <string>
#include <string_view>
#include <utility>

#include "results.hpp"
#include "unflex/flow/translate.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

std::string summary(const flow::TranslatedPrint& print, const machine::Settings& settings) {
  return fmt::format("joints        of a {}: {} moves of the tool in {} lines\n",
                     to_string(settings.kinematics.type), print.moves, print.lines);
}

// Notes on the settings that are about more than compensation.
void add_notes(const machine::Settings& settings, std::vector<std::string>& warnings) {
  std::vector<std::string> notes;
  for (const Diagnostic& note : settings.notes) {
    notes.push_back(to_string(note));
  }
  if (settings.kinematics.type != Kinematics::tripteron &&
      settings.kinematics.type != Kinematics::linear) {
    notes.push_back(fmt::format(
        "unflex: warning: a firmware for a {0} knows itself what its motors do, and prints the "
        "sliced file; print this one only where the firmware's own kinematics are cartesian",
        to_string(settings.kinematics.type)));
  }
  warnings.insert(warnings.begin(), notes.begin(), notes.end());
}

}  // namespace

Result<ExitCode> run_translate(const RunConfig& config, Console& console) {
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  if (space->settings.kinematics.type == Kinematics::cartesian) {
    return fail(ErrorKind::usage,
                "which machine? kinematics.type is \"cartesian\", whose joints are X, Y and Z as "
                "they are; set it to what the machine is, such as tripteron");
  }
  pack_output(config, *space);
  Result<flow::TranslatedPrint> print = with_progress(config, [&](Progress& progress) {
    return flow::translate(*space->input.text(), space->input.name(), space->settings, progress,
                           [&](std::string_view text) { return space->output->write(text); });
  });
  if (const Status unchanged = check_inputs(*space); !unchanged) {
    return tl::unexpected(unchanged.error());
  }
  if (!print) {
    return tl::unexpected(print.error());
  }
  add_notes(space->settings, print->warnings);
  if (Status accepted = accept(config, print->warnings, false, console); !accepted) {
    return tl::unexpected(accepted.error());
  }
  console.warnings(print->warnings);
  return space->output->seal()
      .and_then([&] { return check_inputs(*space); })
      .and_then([&] { return space->output->commit(); })
      .and_then([&] { return print_summary(config, summary(*print, space->settings), console); })
      .map([] { return ExitCode::done; });
}

}  // namespace unflex::app
