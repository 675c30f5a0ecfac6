// Turns the stages' results into the report's plain rows.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/record/recorder.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::flow {

// A report with the facts of the job.
[[nodiscard]] report::Report new_report(std::string command, const Job& job);

// Adds the cost of the work since `begin` to this process and its children.
void add_performance(std::chrono::steady_clock::time_point begin, report::Report& report);

// Gathers where the nozzle strays most, and what input shapers would do.
[[nodiscard]] std::unique_ptr<record::Recorder> recorder_for(const Job& job,
                                                             const verify::Rules& rules);
// The further measurements of a verification.
[[nodiscard]] verify::Observation observation_of(record::Recorder& recorder,
                                                 const verify::Rules& rules);

// Puts the figures of a verification, and what was recorded meanwhile, into the report.
void add_verification(const verify::VerifyReport& verified, record::Recorder& recorder,
                      report::Report& report);

// Verifies the job's output against its input and puts the figures into the report.
[[nodiscard]] Status add_verification(const Job& job, Progress& progress, report::Report& report);

}  // namespace unflex::flow
