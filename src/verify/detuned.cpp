#include "unflex/verify/observer.hpp"

namespace unflex::verify {
std::vector<NozzleModel> detuned(const NozzleModel& model) {
  std::vector<NozzleModel> result;
  for (const double error : kFrequencyErrors) {
    NozzleModel other = model;
    other.x = model.x.detuned(1.0 + error);
    other.y = model.y.detuned(1.0 + error);
    result.push_back(other);
  }
  return result;
}

}  // namespace unflex::verify
