#include "unflex/study/study_machines.hpp"

#include "run_batches.hpp"
#include "unflex/run/setup.hpp"

namespace unflex::study {

Result<study::MachinesOutcome> study_machines(const flow::Job& job,
                                              const std::vector<KnownMachine>& machines,
                                              Progress& progress) {
  if (Status built = flow::check_built(job.engine); !built) {
    return tl::unexpected(built.error());
  }
  const study::Options options{.ipopt = job.engine == flow::EngineChoice::ipopt,
                               .workers = job.workers};
  std::vector<study::MachineBench> benches;
  for (const KnownMachine& known : machines) {
    benches.emplace_back(
        study::Machine{known.name, known.axes, run::compensate_setup(known.settings)}, options);
  }
  const Result<std::vector<Diagnostic>> warnings =
      for_each_batch(job, progress, [&](std::vector<study::Run>&& batch) {
        for (study::MachineBench& bench : benches) {
          bench.add(batch);
        }
      });
  if (!warnings) {
    return tl::unexpected(warnings.error());
  }
  study::MachinesOutcome outcome;
  outcome.input = job.input_name;
  for (const study::MachineBench& bench : benches) {
    outcome.machines.push_back(bench.result());
  }
  for (const Diagnostic& warning : *warnings) {
    outcome.warnings.push_back(to_string(warning));
  }
  return outcome;
}

}  // namespace unflex::study
