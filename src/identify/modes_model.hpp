// The density of several modes, its derivatives, and the zeros of H.
//
// Parameters θ: log f, log ζ and a for each mode in turn, then log N₀ and log N₁. Gains follow from
// g_i = a_i / Σ a and C from (Σ a)², so nothing binds them.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "band.hpp"
#include "least_squares.hpp"

namespace unflex::identify {

class ModesModel {
 public:
  ModesModel(const Band& band, double start_hz);

  // Logarithm of the density and its floor at the bins.
  void operator()(const Eigen::VectorXd& theta, Eigen::ArrayXd& values,
                  Eigen::MatrixXd* jacobian) const;
  // Density of the whole, of one mode alone, and of the noise.
  [[nodiscard]] Eigen::ArrayXd density(const Eigen::VectorXd& theta) const;
  [[nodiscard]] Eigen::ArrayXd mode_density(const Eigen::VectorXd& theta, Eigen::Index mode) const;
  [[nodiscard]] Eigen::ArrayXd noise_density(const Eigen::VectorXd& theta) const;
  // Correlation of the scatter of bins k apart: the window makes neighbours alike.
  [[nodiscard]] double correlation(Eigen::Index apart) const;
  // The number of independent bins that tell as much as the bins of the band.
  [[nodiscard]] double independent_bins() const;
  [[nodiscard]] const Eigen::ArrayXd& freq_hz() const { return freq_hz_; }

 private:
  Eigen::ArrayXd freq_hz_;
  Eigen::ArrayXd floor_;
  Eigen::ArrayXd noise_shape_;  // of N₁
  Eigen::ArrayXd fine_hz_;
  Eigen::ArrayXd excitation_;
  Eigen::VectorXd kernel_;
  std::vector<double> correlation_;
};

[[nodiscard]] inline Eigen::Index modes_in(const Eigen::VectorXd& theta) {
  return (theta.size() - 2) / 3;
}

// log N₁ of noise that is the same at all frequencies.
inline constexpr double kNoRise_log = -40.0;
[[nodiscard]] inline bool rises(const Eigen::VectorXd& theta) {
  return theta[theta.size() - 1] > kNoRise_log;
}

[[nodiscard]] std::vector<ModeOfAxis> modes_of(const Eigen::VectorXd& theta);
// The modes of (log f, log ζ, a) for each in turn.
[[nodiscard]] std::vector<ModeOfAxis> modes_of_logarithms(const Eigen::VectorXd& parameters);

// How N₁ falls with frequency, 1 at 30 Hz.
[[nodiscard]] Eigen::ArrayXd noise_rise(const Eigen::ArrayXd& freq_hz);

// H of one mode at frequencies ν, without its gain.
[[nodiscard]] Eigen::ArrayXcd mode_response(const Eigen::ArrayXd& freq_hz, double mode_hz,
                                            double damping_ratio);

[[nodiscard]] std::vector<std::complex<double>> zeros_of(const std::vector<ModeOfAxis>& modes);
[[nodiscard]] bool is_minimum_phase(const std::vector<ModeOfAxis>& modes);

// θ with the amplitudes a that come closest to H with its zeros mirrored into the left half plane.
[[nodiscard]] Eigen::VectorXd mirrored(const Eigen::VectorXd& theta, const Eigen::ArrayXd& freq_hz);

}  // namespace unflex::identify
