// Which fit of a record to trust, how far, and which other machines it allows.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "modes_interval.hpp"
#include "modes_search.hpp"
#include "response.hpp"
#include "unflex/identify/modes.hpp"

namespace unflex::identify {
namespace {

constexpr Eigen::Index kMostModes = 3;

double divisor(const Spectrum& spectrum, std::size_t k) {
  return spectrum.is_normalized ? static_cast<double>(k) * spectrum.step_hz + 0.1 : 1.0;
}

std::size_t first_bin(const Spectrum& spectrum, const Sweep& sweep) {
  return static_cast<std::size_t>(
      std::ceil(std::max(kFitFrom_hz, 1.2 * sweep.start_hz) / spectrum.step_hz));
}

std::size_t bin_behind(const Spectrum& spectrum, const Sweep& sweep) {
  const auto end = static_cast<std::size_t>(std::max(0.0, 0.965 * sweep.end_hz / spectrum.step_hz));
  return std::min(end, std::ranges::min({spectrum.density[0].size(), spectrum.density[1].size(),
                                         spectrum.density[2].size()}));
}

Result<Band> band_of(const Spectrum& spectrum, const std::vector<double>& density,
                     const Sweep& sweep) {
  constexpr std::size_t kFewest = 25;
  constexpr double kFloor = 0.01;
  constexpr double kNoiseEnds_hz = 30.0;
  if (!(spectrum.step_hz > 0.0)) {
    return fail(ErrorKind::input, "its frequencies do not grow");
  }
  const std::size_t first = first_bin(spectrum, sweep);
  const std::size_t end = bin_behind(spectrum, sweep);
  if (end < first + kFewest) {
    return fail(ErrorKind::input, "it has too few frequencies in the band of the sweep");
  }
  const auto count = static_cast<Eigen::Index>(end - first);
  Band band{
      .step_hz = spectrum.step_hz,
      .first = static_cast<Eigen::Index>(first),
      .freq_hz = Eigen::ArrayXd::LinSpaced(count, static_cast<double>(first) * spectrum.step_hz,
                                           static_cast<double>(end - 1) * spectrum.step_hz),
      .density = Eigen::ArrayXd(count)};
  for (std::size_t k = first; k < end; ++k) {
    band.density[static_cast<Eigen::Index>(k - first)] = density[k] * divisor(spectrum, k);
  }
  const double mean = band.density.mean();
  if (!std::isfinite(mean) || !(mean > 0.0)) {
    return fail(ErrorKind::input, "there is no motion in the band of the sweep");
  }
  band.density /= mean;
  // The floor is a share of the swing, whose density is P/ν², without the noise at low frequencies.
  const Eigen::ArrayXd square = band.freq_hz.square();
  const Eigen::ArrayXd is_high = (band.freq_hz > kNoiseEnds_hz).cast<double>();
  band.floor = kFloor * (band.density / square * is_high).sum() / is_high.sum() * square;
  return band;
}

// Order of the modes by their swing, those in the band first.
std::vector<Eigen::Index> by_swing(const std::vector<ModeOfAxis>& modes, const Band& band) {
  std::vector<Eigen::Index> order(modes.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = static_cast<Eigen::Index>(i);
  }
  const double top_hz = band.freq_hz[band.freq_hz.size() - 1];
  const auto swing = [&](Eigen::Index i) {
    const ModeOfAxis& mode = modes[static_cast<std::size_t>(i)];
    const bool is_inside = mode.freq_hz <= top_hz;
    return (is_inside ? 1.0 : 1e-6) * std::abs(mode.gain) / (mode.damping_ratio * mode.freq_hz);
  };
  std::ranges::stable_sort(order, std::ranges::greater{}, swing);
  return order;
}

// Main mode first.
Eigen::VectorXd in_order(const Eigen::VectorXd& theta, const Band& band) {
  Eigen::VectorXd result = theta;
  Eigen::Index to = 0;
  for (const Eigen::Index from : by_swing(modes_of(theta), band)) {
    result.segment(3 * to++, 3) = theta.segment(3 * from, 3);
  }
  return result;
}

// Why a solution is not to be trusted; empty if it is.
std::string doubt(const Eigen::VectorXd& theta, const Band& band, const ModesModel& model) {
  constexpr double kMostGain = 2.9;
  constexpr double kLeastGain = -1.9;
  constexpr double kMostOfAllGains = 3.0;
  constexpr double kNoiseEnds = 1.35;  // of the band's start
  constexpr double kNear = 1.03;
  constexpr double kMostDampingOfMain = 0.3;
  double all = 0.0;
  const std::vector<ModeOfAxis> modes = modes_of(theta);
  for (const ModeOfAxis& mode : modes) {
    all += std::abs(mode.gain);
    if (!(mode.gain < kMostGain && mode.gain > kLeastGain)) {
      return "its gains nearly cancel";
    }
    if (mode.freq_hz < kNoiseEnds * band.freq_hz[0]) {
      return "what it takes for a resonance may be the noise at low frequencies";
    }
    if (mode.damping_ratio > kMostDamping / kNear) {
      return "its damping grows without bound";
    }
    if (mode.damping_ratio < kLeastDamping * kNear && &mode == &modes.front()) {
      return "its damping vanishes";
    }
  }
  if (modes.front().damping_ratio > kMostDampingOfMain) {
    return "its damping grows without bound";
  }
  if (all > kMostOfAllGains) {
    return "its gains nearly cancel";
  }
  if (modes.front().freq_hz > band.freq_hz[band.freq_hz.size() - 1]) {
    return "its resonance lies at the edge of the sweep or beyond";
  }
  Eigen::Index at = 0;
  (band.freq_hz - modes.front().freq_hz).abs().minCoeff(&at);
  if (model.mode_density(theta, 0)[at] < 2.0 * model.noise_density(theta)[at]) {
    return "its resonance does not stand out of the noise";
  }
  return {};
}

struct Choice {
  const Solution* best = nullptr;
  Eigen::VectorXd theta;  // main mode first
  std::vector<Eigen::VectorXd> rivals;
  std::vector<double> rival_odds;  // to the best's 1
  std::string doubt;               // of the best of all, where another was taken
  Eigen::MatrixXd spread;  // of (log f, log ζ, g) among the fits that nearly equal the best
};

bool has_mode_near(const Eigen::VectorXd& theta, double freq_log) {
  constexpr double kNear = 0.05;
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    if (std::abs(theta[3 * m] - freq_log) < kNear) {
      return true;
    }
  }
  return false;
}

// How (log f, log ζ, g) of another fit differ, for each mode of the best from its nearest.
Eigen::VectorXd difference(const std::vector<ModeOfAxis>& best,
                           const std::vector<ModeOfAxis>& other) {
  constexpr double kFarthest = 0.15;
  Eigen::VectorXd result = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(best.size()));
  for (std::size_t m = 0; m < best.size(); ++m) {
    const auto distance = [&](const ModeOfAxis& mode) {
      return std::abs(std::log(mode.freq_hz / best[m].freq_hz));
    };
    const ModeOfAxis nearest = std::ranges::min(other, {}, distance);
    if (distance(nearest) < kFarthest) {
      result.segment(3 * static_cast<Eigen::Index>(m), 3)
          << std::log(nearest.freq_hz / best[m].freq_hz),
          std::log(nearest.damping_ratio / best[m].damping_ratio), nearest.gain - best[m].gain;
    }
  }
  return result;
}

Choice choose(const std::vector<std::vector<Solution>>& found, const Band& band,
              const ModesModel& model) {
  constexpr double kNearlyEqual = 2.0;  // differences of the criterion
  constexpr double kPhaseWorth = 4.0;
  const auto merit = [](const Solution& s) {
    return s.bic + (s.is_minimum_phase ? 0.0 : kPhaseWorth);
  };
  std::vector<const Solution*> all;
  for (const std::vector<Solution>& some : found) {
    for (const Solution& solution : some) {
      all.push_back(&solution);
    }
  }
  std::ranges::stable_sort(all, {}, [&](const Solution* s) { return merit(*s); });
  Choice choice;
  double odds = 1.0;
  for (const Solution* solution : all) {
    const Eigen::VectorXd theta = in_order(solution->fit.parameters, band);
    const std::string reason = doubt(theta, band, model);
    if (!reason.empty()) {
      if (choice.best == nullptr && choice.doubt.empty()) {
        choice.doubt = reason;
      }
    } else if (choice.best == nullptr) {
      choice.best = solution;
      choice.theta = theta;
      choice.spread = Eigen::MatrixXd::Zero(theta.size() - 2, theta.size() - 2);
    } else {
      const double worse = merit(*solution) - merit(*choice.best);
      const double odd = std::exp(-0.5 * worse);
      const Eigen::VectorXd off = difference(modes_of(choice.theta), modes_of(theta));
      choice.spread += odd * off * off.transpose();
      odds += odd;
      if (worse < kNearlyEqual &&
          (!has_mode_near(choice.theta, theta[0]) || !has_mode_near(theta, choice.theta[0]))) {
        choice.rivals.push_back(theta);
        choice.rival_odds.push_back(odd);
      }
    }
  }
  choice.spread /= odds;
  return choice;
}

std::string numbered(std::size_t modes) {
  return modes == 1 ? "one mode" : fmt::format("{} modes", modes);
}

// Returns the frequency of a peak that the fit does not have, or 0.
double fill_curves(const Band& band, const ModesModel& model, const Eigen::VectorXd& theta,
                   ModesFit& fit) {
  const auto list = [](const Eigen::ArrayXd& values) {
    return std::vector<double>(values.begin(), values.end());
  };
  const Eigen::ArrayXd fitted = model.density(theta);
  fit.curve = {.x = list(band.freq_hz), .measured = list(band.density), .fitted = list(fitted)};
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    fit.mode_curves.push_back(list(model.mode_density(theta, m)));
  }
  const Eigen::ArrayXd noise = model.noise_density(theta);
  fit.noise_curve = list(noise);
  const Misfit misfit = misfit_of(band.freq_hz, band.density, fitted, noise.minCoeff(), 3);
  fit.unexplained = misfit.unexplained;
  constexpr double kTooMuch = 0.35;
  if (misfit.unexplained > kTooMuch) {
    fit.warnings.push_back(
        fmt::format("{} cannot explain this: {:.0f} % of what was measured is something else",
                    numbered(fit.modes.size()), 100.0 * misfit.unexplained));
  }
  return misfit.other_peak_hz;
}

void add_rivals(const Choice& choice, ModesFit& fit) {
  double odds = 1.0;
  for (const double rival : choice.rival_odds) {
    odds += rival;
  }
  for (Plant& plant : fit.plants) {
    plant.share /= odds;
  }
  Estimate& main_hz = fit.intervals.front().freq_hz;
  for (std::size_t i = 0; i < choice.rivals.size(); ++i) {
    fit.plants.push_back(
        {.modes = modes_of(choice.rivals[i]), .share = choice.rival_odds[i] / odds});
    const double freq_hz = fit.plants.back().modes.front().freq_hz;
    main_hz.low = std::min(main_hz.low, freq_hz);
    main_hz.high = std::max(main_hz.high, freq_hz);
  }
}

Result<ModesFit> fit_density(const Spectrum& spectrum, const std::vector<double>& density,
                             const Sweep& sweep) {
  constexpr double kWorthOfAMode = 12.0;
  constexpr double kWorstScatter = 0.6;
  constexpr double kWidestInterval = 1.35;
  const Result<Band> band = band_of(spectrum, density, sweep);
  if (!band) {
    return tl::unexpected(band.error());
  }
  const ModesModel model(*band, sweep.start_hz);
  const Solution still = rigid(model, band->logarithms());
  const std::vector<std::vector<Solution>> found = search(*band, model, sweep, kMostModes);
  ModesFit fit;
  fit.bic.push_back(still.bic);
  for (const std::vector<Solution>& some : found) {
    fit.bic.push_back(std::ranges::min(some, {}, &Solution::bic).bic);
  }
  const std::string advice =
      "; check that the sensor sits tight and measure again with a higher ACCEL_PER_HZ";
  if (*std::ranges::min_element(fit.bic) > still.bic - kWorthOfAMode) {
    return fail(ErrorKind::input, "it shows no resonance" + advice);
  }
  const Choice choice = choose(found, *band, model);
  if (choice.best == nullptr) {
    return fail(ErrorKind::input, "no model of it can be trusted: " + choice.doubt + advice);
  }
  if (choice.best->bic > still.bic - kWorthOfAMode) {
    return fail(ErrorKind::input, "no model of it can be trusted: " + choice.doubt + advice);
  }
  const double scatter =
      std::sqrt(choice.best->fit.loss / static_cast<double>(band->freq_hz.size()));
  if (scatter > kWorstScatter) {
    return fail(ErrorKind::input,
                fmt::format("up to {} modes cannot explain it", kMostModes) + advice);
  }
  fit.modes = modes_of(choice.theta);
  fit.is_minimum_phase = choice.best->is_minimum_phase;
  if (!choice.doubt.empty()) {
    fit.warnings.push_back(fmt::format("a closer fit than that of {} is not to be trusted: {}",
                                       numbered(fit.modes.size()), choice.doubt));
  }
  add_intervals(model, *band, prior_of(modes_in(choice.theta), sweep), choice.theta, choice.spread,
                fit);
  add_rivals(choice, fit);
  const Estimate& main_hz = fit.intervals.front().freq_hz;
  if (main_hz.high > kWidestInterval * main_hz.low) {
    return fail(ErrorKind::input,
                fmt::format("its main resonance may be anywhere from {:.0f} to {:.0f} Hz",
                            main_hz.low, main_hz.high) +
                    advice);
  }
  if (fit.intervals.front().gain.low < 0.0 && fit.intervals.front().gain.high > 0.0) {
    return fail(
        ErrorKind::input,
        fmt::format("it leaves open how strong its resonance at {:.1f} Hz is", main_hz.value) +
            advice);
  }
  if (!choice.rivals.empty()) {
    fit.warnings.push_back(
        fmt::format("another model fits as well, with {:.1f} Hz instead of {:.1f} Hz: measure once "
                    "more",
                    std::exp(choice.rivals.front()[0]), main_hz.value));
  }
  const double other_peak_hz = fill_curves(*band, model, choice.theta, fit);
  if (other_peak_hz > 0.0) {
    return fail(ErrorKind::input, fmt::format("{} cannot explain its peak near {:.1f} Hz",
                                              numbered(fit.modes.size()), other_peak_hz) +
                                      advice);
  }
  return fit;
}

}  // namespace

AxisDensity density_of_axis(const Spectrum& spectrum, const Sweep& sweep) {
  constexpr double kMajority = 0.6;
  AxisDensity result;
  if (!(spectrum.step_hz > 0.0)) {
    return result;
  }
  const std::size_t first = first_bin(spectrum, sweep);
  const std::size_t end = bin_behind(spectrum, sweep);
  std::array<double, 3> energy{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = first; k < end; ++k) {
      energy[c] += spectrum.density[c][k] * divisor(spectrum, k);
    }
  }
  const double whole = energy[0] + energy[1] + energy[2];
  const auto most = static_cast<std::size_t>(std::ranges::max_element(energy) - energy.begin());
  result.share = whole > 0.0 ? energy[most] / whole : 0.0;
  if (result.share >= kMajority) {
    result.column = static_cast<int>(most);
    result.density = spectrum.density[most];
    return result;
  }
  const std::size_t length = std::ranges::min(
      {spectrum.density[0].size(), spectrum.density[1].size(), spectrum.density[2].size()});
  for (std::size_t k = 0; k < length; ++k) {
    result.density.push_back(spectrum.density[0][k] + spectrum.density[1][k] +
                             spectrum.density[2][k]);
  }
  return result;
}

Result<ModesFit> fit_modes(const Spectrum& spectrum, const Sweep& sweep) {
  const AxisDensity density = density_of_axis(spectrum, sweep);
  Result<ModesFit> fit = fit_density(spectrum, density.density, sweep);
  if (fit) {
    fit->column = density.column;
  }
  return fit;
}

}  // namespace unflex::identify
