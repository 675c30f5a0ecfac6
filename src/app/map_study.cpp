#include "map_study.hpp"

#include "inspection.hpp"
#include "outputs.hpp"
#include "print_work.hpp"
#include "unflex/study/study_map.hpp"

namespace unflex::app {

Result<ExitCode> run_map_study(const RunConfig& config, Console& console) {
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  Result<study::MapOutcome> outcome = work_on_print(config, *space, study::study_map);
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  outcome->version = version();
  outcome->printer = settings_in_force(space->settings);
  add_setting_warnings(space->settings, outcome->warnings);
  console.warnings(outcome->warnings);
  return write_report(space->report, study::to_json(*outcome))
      .and_then([&] { return print_summary(config, study::to_text(*outcome), console); })
      .map([] { return ExitCode::done; });
}

}  // namespace unflex::app
