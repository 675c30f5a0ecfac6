// The uncertainty that a record leaves around a fit.
#pragma once

#include <vector>

#include "modes_model.hpp"

namespace unflex::identify {

// Covariance of (log f, log ζ, g) for each mode of θ, with g_i = a_i / Σ a. It follows from
// `covariance`, whose first rows belong to the modes in θ.
[[nodiscard]] Eigen::MatrixXd of_gains(const Eigen::MatrixXd& covariance,
                                       const Eigen::VectorXd& theta);

// Covariance of (log f, log ζ, g) for each mode of a fit to a spectrum.
[[nodiscard]] Eigen::MatrixXd covariance_of_modes(const ModesModel& model, const Band& band,
                                                  const Prior& prior, const Eigen::VectorXd& theta);

// H of all modes at frequencies ν.
[[nodiscard]] Eigen::ArrayXcd response_of(const Eigen::ArrayXd& freq_hz,
                                          const std::vector<ModeOfAxis>& modes);

// How far apart the nozzles of two models swing, and how far one swings from its base, per speed of
// the base: ‖ΔH/ν‖ and ‖(H − 1)/ν‖ over the frequencies of a sweep.
[[nodiscard]] double distance(const std::vector<ModeOfAxis>& a, const std::vector<ModeOfAxis>& b);
[[nodiscard]] double swing(const std::vector<ModeOfAxis>& modes);

// Standard deviation of |H(ν)| at one frequency, as a share of it.
[[nodiscard]] double spread_of_response(double freq_hz, const std::vector<ModeOfAxis>& modes,
                                        const Eigen::MatrixXd& covariance);

// The modes with their intervals, and plants around them, by the covariance of (log f, log ζ, g).
[[nodiscard]] AxisModel model_of(Method method, const std::vector<ModeOfAxis>& modes,
                                 const Eigen::MatrixXd& covariance);

}  // namespace unflex::identify
