// The steps that commands on a print share, from its workspace to what they find.
#pragma once

#include "results.hpp"
#include "unflex/flow/flow.hpp"
#include "workspace.hpp"

namespace unflex::app {

// What work(job, progress), a Result, makes of the print under a progress bar. An error, too, if an
// input has changed meanwhile.
template <class Work>
auto work_on_print(const RunConfig& config, Workspace& space, Work work)
    -> decltype(work(std::declval<const flow::Job&>(), std::declval<Progress&>())) {
  const Result<flow::Job> job = job_of(config, space);
  if (!job) {
    return tl::unexpected(job.error());
  }
  auto found = with_progress(config, [&](Progress& progress) { return work(*job, progress); });
  if (const Status unchanged = check_inputs(space); !unchanged) {
    return tl::unexpected(unchanged.error());
  }
  return found;
}

}  // namespace unflex::app
