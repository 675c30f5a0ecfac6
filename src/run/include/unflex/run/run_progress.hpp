// The progress of the work on a run, so that a bar moves while a long run is computed.
#pragma once

#include <atomic>
#include <cstddef>

#include "unflex/compensate/axis_window.hpp"

namespace unflex::run {

struct RunJob;

// An engine that counts what it has solved.
class CountedEngine final : public compensate::Engine {
 public:
  CountedEngine(const compensate::Engine& engine, std::atomic<std::size_t>& nodes)
      : engine_(&engine), nodes_(&nodes) {}

  [[nodiscard]] Result<compensate::AxisSolution> solve(
      const compensate::AxisWindow& window) const override;
  [[nodiscard]] std::string name() const override { return engine_->name(); }

 private:
  const compensate::Engine* engine_;
  std::atomic<std::size_t>* nodes_;
};

// What share of the work on the run is done, about, from 0 to 1.
[[nodiscard]] double share_done(const RunJob& job);

}  // namespace unflex::run
