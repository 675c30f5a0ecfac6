#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "ring_fit.hpp"
#include "sweep_fit.hpp"
#include "unflex/core/math.hpp"
#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {
namespace {

using Samples = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// How much an axis moved. Differences of neighbours favour the band in which resonances are.
double motion(const std::vector<double>& samples) {
  double sum = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    sum += math::square(samples[i] - samples[i - 1]);
  }
  return sum;
}

double motion(const DataSet& set, std::size_t axis) {
  if (const auto* recording = std::get_if<Recording>(&set.data)) {
    return motion(recording->accel[axis]);
  }
  double sum = 0.0;
  for (const double density : std::get<Spectrum>(set.data).density[axis]) {
    sum += density;
  }
  return sum;
}

Samples centred(const Recording& recording) {
  Samples samples(static_cast<Eigen::Index>(recording.accel[0].size()), 3);
  for (Eigen::Index c = 0; c < 3; ++c) {
    const std::vector<double>& column = recording.accel[static_cast<std::size_t>(c)];
    samples.col(c) = Eigen::Map<const Eigen::VectorXd>(column.data(), samples.rows());
  }
  return samples.rowwise() - samples.colwise().mean();
}

// The direction in which the samples scatter most, with its largest part above 0.
Eigen::Vector3d principal_direction(const Samples& samples) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> parts(
      Eigen::Matrix3d(samples.transpose() * samples));
  const Eigen::Vector3d direction = parts.eigenvectors().col(2);
  Eigen::Index most = 0;
  direction.cwiseAbs().maxCoeff(&most);
  return direction[most] < 0.0 ? Eigen::Vector3d(-direction) : direction;
}

// The direction of the sensor along which the axis moved.
Eigen::Vector3d direction_of(const Recording& recording, const Samples& samples, Axis axis) {
  constexpr double kMovedToo = 0.1;  // as a share of the amplitude along the principal direction
  const Eigen::Vector3d principal = principal_direction(samples);
  const Eigen::Index column = axis == Axis::x ? 0 : 1;
  const bool is_column =
      recording.is_along_axes &&
      samples.col(column).norm() >= kMovedToo * Eigen::VectorXd(samples * principal).norm();
  return is_column ? Eigen::Vector3d(Eigen::Vector3d::Unit(column)) : principal;
}

// The axis' motion as the sensor felt it.
struct Motion {
  std::vector<double> samples;
  std::array<double, 3> direction{};  // as RecordFit's
};

Motion motion_of(const Recording& recording, Axis axis) {
  const Samples all = centred(recording);
  const Eigen::Vector3d direction = direction_of(recording, all, axis);
  const Eigen::VectorXd along = all * direction;
  return {{along.begin(), along.end()}, {direction[0], direction[1], direction[2]}};
}

// Whether the value lies in a finite interval above 0.
bool is_known(const Estimate& estimate) {
  return estimate.low > 0.0 && estimate.low <= estimate.value && estimate.value <= estimate.high &&
         std::isfinite(estimate.high);
}

bool is_known(const ModeEstimate& mode) {
  return is_known(mode.freq_hz) && is_known(mode.damping_ratio) && mode.damping_ratio.value < 1.0 &&
         std::isfinite(mode.gain.low) && std::isfinite(mode.gain.high);
}

}  // namespace

Axis dominant_axis(const DataSet& set) {
  return motion(set, 1) > motion(set, 0) ? Axis::y : Axis::x;
}

Result<RecordFit> fit_recording(const Recording& recording, Axis axis, const Sweep& sweep) {
  const Motion motion = motion_of(recording, axis);
  Result<RecordFit> record = holds_sweep(motion.samples, recording.rate_hz)
                                 ? fit_sweep(motion.samples, recording.rate_hz, sweep)
                                 : fit_ringing(motion.samples, recording.rate_hz);
  if (record) {
    record->direction = motion.direction;
  }
  return record;
}

Result<RecordFit> fit_second(const DataSet& set, Axis axis, const std::vector<ModeOfAxis>& known) {
  const auto* recording = std::get_if<Recording>(&set.data);
  if (recording == nullptr) {
    return fail(ErrorKind::input, {set.name, 0},
                "is a spectrum; a second mode shows in recordings of compensated stops, which "
                "unflex identify --make-test makes the printer do");
  }
  const Motion motion = motion_of(*recording, axis);
  Result<RecordFit> record = fit_ringing(motion.samples, recording->rate_hz, known);
  if (!record) {
    RecordFit refused;
    refused.model.method = Method::ringing;
    refused.refusal = record.error().message;
    return refused;
  }
  record->direction = motion.direction;
  return record;
}

Result<RecordFit> fit(const DataSet& set, Axis axis, const Sweep& sweep) {
  const auto* recording = std::get_if<Recording>(&set.data);
  Result<RecordFit> record = recording != nullptr
                                 ? fit_recording(*recording, axis, sweep)
                                 : fit_spectrum(std::get<Spectrum>(set.data), sweep);
  if (!record) {
    return fail(record.error().kind, {set.name, 0}, record.error().message);
  }
  // A mode without finite intervals does not describe a resonance.
  if (record->is_trusted() &&
      !std::ranges::all_of(record->model.modes,
                           [](const ModeEstimate& mode) { return is_known(mode); })) {
    record->refusal = "no resonance can be made out in it; measure once more";
  }
  return record;
}

}  // namespace unflex::identify
