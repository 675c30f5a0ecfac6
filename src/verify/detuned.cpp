#include "unflex/verify/observer.hpp"

namespace unflex::verify {
std::vector<NozzleModel> detuned(const NozzleModel& model) {
  std::vector<NozzleModel> result;
  for (const double error : kFrequencyErrors) {
    NozzleModel other = model;
    for_each_axis([&](dynamics::FlexibleAxis& axis) { axis = axis.detuned(1.0 + error); }, other);
    if (other.frame) {
      other.frame = other.frame->detuned(1.0 + error);
    }
    result.push_back(other);
  }
  return result;
}

}  // namespace unflex::verify
