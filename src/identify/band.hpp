// The part of a spectrum that a fit looks at.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/math.hpp"
#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

inline constexpr double kFitFrom_hz = 15.0;

// The density of a spectrum that stands for the axis. A sensor may be mounted turned. So it is the
// column with three fifths of the energy in the band, or else the sum of all three.
struct AxisDensity {
  std::vector<double> density;  // as Spectrum's
  // The column with the most energy, where the density is the sum.
  std::optional<std::size_t> most_of_sum;
  std::array<double, 3> direction{};  // roots of the columns' shares of the energy
};

// `spectrum`: of the acceleration, as as_acceleration() gives it.
[[nodiscard]] AxisDensity density_of_axis(const Spectrum& spectrum, const Sweep& sweep);

// The bins of a density in the band of the sweep, relative to their mean, as acceleration.
struct Band {
  double step_hz = 0.0;
  Eigen::Index first = 0;
  Eigen::ArrayXd freq_hz;
  Eigen::ArrayXd density;
  // Added to measured and fitted density before their logarithms are compared. A density below it
  // moves the nozzle little, and must not cost a mode.
  Eigen::ArrayXd floor = {};

  [[nodiscard]] Eigen::ArrayXd logarithms() const {
    return (density + floor).unaryExpr(&math::log);
  }
  [[nodiscard]] double top_hz() const { return freq_hz[freq_hz.size() - 1]; }
};

// Errors are of kind input: too few frequencies, or no motion.
[[nodiscard]] Result<Band> band_of(const Spectrum& spectrum, const std::vector<double>& density,
                                   const Sweep& sweep);

}  // namespace unflex::identify
