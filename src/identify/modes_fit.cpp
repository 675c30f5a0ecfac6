// Whether a record carries a model, how far it is to be trusted, and which other machines it
// allows.
#include "modes_fit.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "modes_interval.hpp"
#include "response.hpp"
#include "unflex/core/math.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

constexpr Eigen::Index kMostModes = 3;
constexpr double kWorthOfAMode = 12.0;  // by the criterion

std::string numbered(std::size_t modes) {
  return modes == 1 ? "one mode" : fmt::format("{} modes", modes);
}

void fill_curves(const Band& band, const ModesModel& model, const Eigen::VectorXd& theta,
                 Curve& curve) {
  const auto list = [](const Eigen::ArrayXd& values) {
    return std::vector<double>(values.begin(), values.end());
  };
  curve = {.x = list(band.freq_hz),
           .measured = list(band.density),
           .fitted = list(model.density(theta)),
           .modes = {},
           .noise = list(model.noise_density(theta))};
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    curve.modes.push_back(list(model.mode_density(theta, m)));
  }
}

// Other models that fit about as well become plants. The main mode may lie where theirs does.
void add_rivals(const Choice& choice, AxisModel& model) {
  double odds = 1.0;
  for (const Rival& rival : choice.rivals) {
    odds += rival.odds;
  }
  for (Plant& plant : model.plants) {
    plant.share /= odds;
  }
  Estimate& main_hz = model.modes.front().freq_hz;
  for (const Rival& rival : choice.rivals) {
    model.plants.push_back({.modes = modes_of(rival.theta), .share = rival.odds / odds});
    if (rival.has_other_main) {
      widen(main_hz, model.plants.back().modes.front().freq_hz);
    }
  }
}

// Why the record carries no model; empty if it does.
std::string refusal_of(const Choice& choice, const Band& band, const RecordFit& record,
                       const Eigen::MatrixXd& covariance, const Misfit& misfit) {
  constexpr double kWorstScatter = 0.6;
  constexpr double kWidestInterval = 1.35;
  constexpr double kWidestSwing = 0.4;  // standard deviation
  constexpr double kTooMuch = 0.35;
  const double still = record.bic.front();
  if (*std::ranges::min_element(record.bic) > still - kWorthOfAMode) {
    return "it shows no resonance";
  }
  if (choice.best == nullptr || choice.best->bic > still - kWorthOfAMode) {
    return "no model of it can be trusted: " + choice.doubt;
  }
  const std::size_t modes = record.model.modes.size();
  if (std::sqrt(choice.best->fit.loss / static_cast<double>(band.freq_hz.size())) > kWorstScatter) {
    return fmt::format("up to {} modes cannot explain it", kMostModes);
  }
  const ModeEstimate& main = record.model.modes.front();
  if (main.freq_hz.high > kWidestInterval * main.freq_hz.low) {
    return fmt::format("its main resonance may be anywhere from {:.0f} to {:.0f} Hz",
                       main.freq_hz.low, main.freq_hz.high);
  }
  // Gains of modes close to each other may be open although their sum is not.
  const double spread = spread_of_response(main.freq_hz.value, record.model.values(), covariance);
  if (spread > kWidestSwing) {
    return fmt::format("it leaves open how strong its resonance at {:.1f} Hz is",
                       main.freq_hz.value);
  }
  if (misfit.unexplained > kTooMuch) {
    return fmt::format("{} cannot explain it: {:.0f} % of what was measured is something else",
                       numbered(modes), 100.0 * misfit.unexplained);
  }
  return misfit.other_peak_hz > 0.0 ? fmt::format("{} cannot explain its peak near {:.1f} Hz",
                                                  numbered(modes), misfit.other_peak_hz)
                                    : std::string{};
}

void add_warnings(const Choice& choice, const Band& band, RecordFit& record) {
  constexpr double kLargeGain = 0.15;
  constexpr double kMuch = 0.25;
  const std::size_t modes = record.model.modes.size();
  if (!choice.doubt.empty() && choice.closer_by > kWorthOfAMode) {
    record.warnings.push_back(fmt::format("a closer fit than that of {} is not to be trusted: {}",
                                          numbered(modes), choice.doubt));
  }
  const auto rival = std::ranges::find_if(choice.rivals, &Rival::has_other_main);
  if (rival != choice.rivals.end()) {
    record.warnings.push_back(
        fmt::format("another model fits as well, with {:.1f} Hz instead of {:.1f} Hz: measure once "
                    "more",
                    math::exp(rival->theta[0]), record.model.modes.front().freq_hz.value));
  }
  for (const ModeEstimate& mode : record.model.modes) {
    if (mode.freq_hz.value > band.top_hz() && std::abs(mode.gain.value) > kLargeGain) {
      record.warnings.push_back(
          fmt::format("its mode at {:.0f} Hz lies beyond the sweep, so that little is known of it; "
                      "sweep further, and say with --freq-end how far",
                      mode.freq_hz.value));
    }
  }
  if (record.unexplained > kMuch) {
    record.warnings.push_back(
        fmt::format("{} cannot explain this: {:.0f} % of what was measured is something else",
                    numbered(modes), 100.0 * record.unexplained));
  }
}

}  // namespace

namespace {

Result<ModesFit> fit_density(const Spectrum& spectrum, const std::vector<double>& density,
                             const Sweep& sweep) {
  const Result<Band> band = band_of(spectrum, density, sweep);
  if (!band) {
    return tl::unexpected(band.error());
  }
  const ModesModel model(*band, sweep.start_hz);
  const std::vector<std::vector<Solution>> found = search(*band, model, sweep, kMostModes);
  if (found.empty()) {
    return fail(ErrorKind::input, "no modes can be fitted to it");
  }
  ModesFit fit;
  RecordFit& record = fit.record;
  record.bic.push_back(rigid(model, band->logarithms()).bic);
  for (const std::vector<Solution>& some : found) {
    record.bic.push_back(std::ranges::min(some, {}, &Solution::bic).bic);
  }
  const Choice choice = choose(found, *band, model);
  fit.theta = choice.theta;
  fit.has_rivals = has_other_main(choice);
  const Prior prior = prior_of(fit.theta, sweep);
  const Eigen::MatrixXd covariance =
      covariance_of_modes(model, *band, prior, fit.theta) + choice.spread;
  record.model = model_of(Method::spectrum, modes_of(fit.theta), covariance);
  add_rivals(choice, record.model);
  fill_curves(*band, model, fit.theta, record.curve);
  const Misfit misfit = misfit_of(band->freq_hz, band->density, model.density(fit.theta),
                                  model.noise_density(fit.theta).minCoeff(), 3);
  record.unexplained = misfit.unexplained;
  record.refusal = refusal_of(choice, *band, record, covariance, misfit);
  if (record.is_trusted()) {
    add_warnings(choice, *band, record);
  }
  return fit;
}

// Where the columns of a sensor share the motion, they show the same resonances, unless the tool
// moves in more directions than one.
std::string disagreement(const RecordFit& sum, const RecordFit& column) {
  constexpr double kApart = 0.2;
  const double of_sum_hz = sum.model.values().front().freq_hz;
  const double of_column_hz = column.model.values().front().freq_hz;
  return std::abs(math::log(of_sum_hz / of_column_hz)) > kApart
             ? fmt::format(
                   "the sensor's columns tell of different resonances, {:.1f} Hz and "
                   "{:.1f} Hz",
                   of_column_hz, of_sum_hz)
             : std::string{};
}

}  // namespace

Result<ModesFit> fit_modes(const Spectrum& given, const Sweep& sweep) {
  const Spectrum spectrum = as_acceleration(given);
  const AxisDensity axis = density_of_axis(spectrum, sweep);
  Result<ModesFit> fit = fit_density(spectrum, axis.density, sweep);
  if (!fit) {
    return fit;
  }
  RecordFit& record = fit->record;
  record.direction = axis.direction;
  if (axis.most_of_sum && record.is_trusted()) {
    if (const Result<ModesFit> column =
            fit_density(spectrum, spectrum.density[*axis.most_of_sum], sweep)) {
      record.refusal = disagreement(record, column->record);
    }
  }
  if (!record.is_trusted()) {
    record.refusal +=
        "; check that the sensor sits tight and measure again with a higher ACCEL_PER_HZ";
  }
  return fit;
}

Result<RecordFit> fit_spectrum(const Spectrum& spectrum, const Sweep& sweep) {
  return fit_modes(spectrum, sweep).map([](ModesFit&& fit) { return std::move(fit.record); });
}

}  // namespace unflex::identify
