#include <algorithm>

#include "unflex/verify/observer.hpp"

namespace unflex::verify {
namespace {

// The nozzle moves smoothly, so a tenth of the steps gives the same maxima within 1 %.
constexpr double kCoarseStep_s = 1e-3;

}  // namespace

std::vector<NozzleModel> detuned(const NozzleModel& model) {
  std::vector<NozzleModel> result;
  for (const double error : kFrequencyErrors) {
    NozzleModel other = model;
    other.x = model.x.detuned(1.0 + error);
    other.y = model.y.detuned(1.0 + error);
    other.step_s = std::max(model.step_s, kCoarseStep_s);
    result.push_back(other);
  }
  return result;
}

}  // namespace unflex::verify
