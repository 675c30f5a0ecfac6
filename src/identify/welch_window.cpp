#include "welch_window.hpp"

#include <cmath>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::identify {

Eigen::VectorXd kaiser_amplitude() {
  Eigen::VectorXd amplitude(2 * kPartsOfBin * kReachOfWindow + 1);
  for (Eigen::Index i = 0; i < amplitude.size(); ++i) {
    const double x = static_cast<double>(i) / kPartsOfBin - kReachOfWindow;
    const double square =
        kBetaOfWindow * kBetaOfWindow - std::numbers::pi * std::numbers::pi * x * x;
    const double root = std::sqrt(std::abs(square));
    const auto sinh = [](double of) { return 0.5 * (math::expm1(of) - math::expm1(-of)); };
    amplitude[i] = root < 1e-9 ? 1.0 : (square > 0.0 ? sinh(root) : math::sin(root)) / root;
  }
  return amplitude;
}

}  // namespace unflex::identify
