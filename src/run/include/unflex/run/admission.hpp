// Decides the setup with which each run is worked out, or the reason why it is kept.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "unflex/report/report.hpp"
#include "unflex/run/machine_model.hpp"
#include "unflex/run/nozzle_motion.hpp"
#include "unflex/run/run_job.hpp"
#include "unflex/run/setup.hpp"

namespace unflex::run {

class Admission {
 public:
  // kept: runs that earlier passes blamed. The machine, kept and the report must outlive the
  // Admission.
  Admission(MachineModel& machine, std::string input_name,
            const std::vector<verify::BlamedRun>& kept, report::Report& report);

  // The next piece of the file. Afterwards the job is read, timed if its timing stays as sliced, or
  // lined if the piece is kept.
  void admit(RunJob& job);

 private:
  void keep_lines(RunJob& job);
  double prepare(RunJob& job);
  dynamics::NozzleXY nozzle_at(const Piece& run);
  void warn_if_capped(const RunSetup& setup, const Piece& piece);
  [[nodiscard]] std::vector<std::string> blamed_before(const Piece& piece) const;
  [[nodiscard]] std::string refusal(const RunJob& job, double asked_accel_mm_s2) const;

  MachineModel* machine_;
  std::shared_ptr<const RunRules> rules_;  // of the run at hand
  std::optional<int> tool_;                // of the last piece between runs; unset: none has come
  std::string input_name_;
  const std::vector<verify::BlamedRun>* kept_;
  report::Report* report_;
  // The nozzle after the last piece read, as if every run so far were compensated. Kept motion
  // leaves a swing, with which the next run starts.
  NozzleFollower nozzle_;
  bool told_of_cap_ = false;
};

}  // namespace unflex::run
