// A progress that is cancelled from the beginning.
#pragma once

#include "unflex/core/progress.hpp"

namespace unflex::testing {

class StoppedProgress final : public Progress {
 public:
  void update(std::string_view /*stage*/, double /*fraction*/) override {}
  [[nodiscard]] bool cancelled() const override { return true; }
};

}  // namespace unflex::testing
