// From the stages' results to the report's plain rows.
#pragma once

#include <chrono>
#include <string>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/pipeline/pipeline.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

// A report with what the job itself says.
[[nodiscard]] report::Report new_report(std::string command, const Job& job);

// What the work since `begin` has cost this process and its children.
void add_performance(std::chrono::steady_clock::time_point begin, report::Report& report);

// Puts the figures of a verification into the report.
void add_verification(const verify::VerifyReport& verified, report::Report& report);

// Verifies the job's output against its input and puts the figures into the report.
[[nodiscard]] Status add_verification(const Job& job, Progress& progress, report::Report& report);

}  // namespace unflex::pipeline
