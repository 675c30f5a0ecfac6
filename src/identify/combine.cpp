// Several records of an axis: each tells of the machine as it was, with errors of its own, and the
// machine itself changes from record to record. This is the random-effects model of DerSimonian and
// Laird (Meta-analysis in Clinical Trials, 1986):
//   x_k = μ + δ_k + ε_k,   var ε_k = σ_k²,   var δ_k = τ²,
// for each parameter x of (log f, log ζ, g). The axis on another day is μ + δ, with variance
// τ² + var μ.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "modes_interval.hpp"
#include "response.hpp"
#include "unflex/core/math.hpp"
#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {
namespace {

constexpr double kLeastVariance = 1e-12;

Eigen::MatrixXd covariance_of(const AxisModel& model) {
  const auto count = 3 * static_cast<Eigen::Index>(model.modes.size());
  return Eigen::Map<const Eigen::MatrixXd>(model.covariance.data(), count, count);
}

// (log f, log ζ, g) for each mode in turn.
Eigen::VectorXd parameters_of(const std::vector<ModeOfAxis>& modes) {
  Eigen::VectorXd result(3 * static_cast<Eigen::Index>(modes.size()));
  for (std::size_t m = 0; m < modes.size(); ++m) {
    result.segment(3 * static_cast<Eigen::Index>(m), 3) << math::log(modes[m].freq_hz),
        math::log(modes[m].damping_ratio), modes[m].gain;
  }
  return result;
}

// The modes in the order of the modes of `like`, each one the nearest in frequency. Empty if the
// numbers of modes differ, if two modes would share one, or if a mode is too far off to be the
// same.
std::vector<std::size_t> matched(const std::vector<ModeOfAxis>& modes,
                                 const std::vector<ModeOfAxis>& like) {
  constexpr double kFarthest = 0.15;  // of the logarithm of the frequency
  std::vector<std::size_t> order;
  if (modes.size() != like.size()) {
    return order;
  }
  for (const ModeOfAxis& one : like) {
    const auto distance = [&](const ModeOfAxis& mode) {
      return std::abs(math::log(mode.freq_hz / one.freq_hz));
    };
    const auto nearest = std::ranges::min_element(modes, {}, distance);
    const auto at = static_cast<std::size_t>(nearest - modes.begin());
    if (distance(*nearest) > kFarthest || std::ranges::find(order, at) != order.end()) {
      return {};
    }
    order.push_back(at);
  }
  return order;
}

struct Measurement {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;
};

// The records' parameters in the order of the first one's modes; empty if their modes are not the
// same.
std::vector<Measurement> measurements(const std::vector<AxisModel>& models) {
  std::vector<Measurement> result;
  for (const AxisModel& model : models) {
    const std::vector<std::size_t> order = matched(model.values(), models.front().values());
    if (order.empty()) {
      return {};
    }
    std::vector<Eigen::Index> places;
    for (const std::size_t m : order) {
      for (Eigen::Index i = 0; i < 3; ++i) {
        places.push_back(3 * static_cast<Eigen::Index>(m) + i);
      }
    }
    result.push_back({parameters_of(model.values())(places), covariance_of(model)(places, places)});
  }
  return result;
}

// τ² of one parameter.
double spread_of(const Eigen::ArrayXd& values, const Eigen::ArrayXd& variances) {
  const Eigen::ArrayXd weights = variances.inverse();
  const double mean = (weights * values).sum() / weights.sum();
  const double scatter = (weights * (values - mean).square()).sum();
  const double freedom = static_cast<double>(values.size() - 1);
  const double scale = weights.sum() - weights.square().sum() / weights.sum();
  return std::max(0.0, (scatter - freedom) / scale);
}

AxisModel averaged(const std::vector<Measurement>& all) {
  const Eigen::Index count = all.front().parameters.size();
  const auto records = static_cast<Eigen::Index>(all.size());
  Eigen::VectorXd mean(count);
  Eigen::VectorXd spread(count);
  Eigen::MatrixXd shares(count, records);
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::ArrayXd values(records);
    Eigen::ArrayXd variances(records);
    for (Eigen::Index k = 0; k < records; ++k) {
      const Measurement& one = all[static_cast<std::size_t>(k)];
      values[k] = one.parameters[i];
      variances[k] = std::max(one.covariance(i, i), kLeastVariance);
    }
    spread[i] = spread_of(values, variances);
    const Eigen::ArrayXd weights = (variances + spread[i]).inverse();
    shares.row(i) = (weights / weights.sum()).matrix().transpose();
    mean[i] = shares.row(i).dot(values.matrix());
  }
  // var μ = Σ w² (σ² + τ²), and δ on top.
  Eigen::MatrixXd covariance = spread.asDiagonal();
  for (Eigen::Index k = 0; k < records; ++k) {
    const Eigen::VectorXd w = shares.col(k);
    Eigen::MatrixXd of_record = all[static_cast<std::size_t>(k)].covariance;
    of_record.diagonal() += spread;
    covariance += w.asDiagonal() * of_record * w.asDiagonal();
  }
  return model_of(Method::combined, modes_of_logarithms(mean), covariance);
}

double width(const AxisModel& model) {
  const Estimate& main_hz = model.modes.front().freq_hz;
  return math::log(main_hz.high / main_hz.low);
}

// The record whose model is nearest to the others'. Where two are as near, the one with the
// narrower interval counts. The others are plants.
AxisModel with_others_as_plants(const std::vector<AxisModel>& models) {
  const AxisModel* middle = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const AxisModel& model : models) {
    double sum = 0.0;
    for (const AxisModel& other : models) {
      sum += distance(model.values(), other.values());
    }
    const bool is_equal = middle != nullptr && sum < 1.001 * least;
    if (sum < 0.999 * least || (is_equal && width(model) < width(*middle))) {
      least = sum;
      middle = &model;
    }
  }
  AxisModel result = *middle;
  result.method = Method::combined;
  const double share = 1.0 / static_cast<double>(models.size());
  for (Plant& plant : result.plants) {
    plant.share *= share;
  }
  Estimate& main_hz = result.modes.front().freq_hz;
  for (const AxisModel& model : models) {
    if (&model != middle) {
      result.plants.push_back({.modes = model.values(), .share = share});
      widen(main_hz, model.values().front().freq_hz);
    }
  }
  return result;
}

// The modes of an axis, some of them replaced by modes out of `known`. Gains stay. The replacements
// change how the axis swings by no more than `most`.
std::vector<ModeOfAxis> shared_with(const std::vector<ModeOfAxis>& known,
                                    const std::vector<ModeOfAxis>& own, double most) {
  std::vector<ModeOfAxis> modes = own;
  std::vector<bool> is_shared(modes.size(), false);
  const auto replaced = [&](std::size_t m, const ModeOfAxis& by) {
    std::vector<ModeOfAxis> other = modes;
    other[m].freq_hz = by.freq_hz;
    other[m].damping_ratio = by.damping_ratio;
    return other;
  };
  // Each round replaces the mode with the least effect.
  for (std::size_t round = 0; round < modes.size(); ++round) {
    double least = most;
    std::size_t which = modes.size();
    std::vector<ModeOfAxis> best;
    for (std::size_t m = 0; m < modes.size(); ++m) {
      for (const ModeOfAxis& mode : known) {
        std::vector<ModeOfAxis> other = replaced(m, mode);
        const double change = is_shared[m] ? most : distance(other, own);
        if (change < least) {
          least = change;
          which = m;
          best = std::move(other);
        }
      }
    }
    if (which == modes.size()) {
      break;
    }
    modes = std::move(best);
    is_shared[which] = true;
  }
  return modes;
}

}  // namespace

std::string_view to_string(Method method) {
  constexpr std::array<std::string_view, 5> kNames = {"sweep", "spectrum", "ringing", "tower",
                                                      "combined"};
  return kNames[static_cast<std::size_t>(method)];
}

std::vector<Plant> other_plants(const AxisModel& model) {
  constexpr double kNear = 0.03;
  // A change by less than this share of the swing does not count. The plants' errors change by a
  // few per cent, and each mode less makes the base cheaper to find.
  constexpr double kNothing = 0.1;
  constexpr std::size_t kMost = 6;
  const auto away = [&](const Plant& plant) { return distance(plant.modes, model.values()); };
  std::vector<Plant> others(model.plants.begin() + 1, model.plants.end());
  const double far = kNear * swing(model.values());
  if (std::ranges::all_of(others, [&](const Plant& plant) { return away(plant) < far; })) {
    return {};
  }
  // The ones that weigh most stand for all.
  double all = 0.0;
  for (const Plant& plant : others) {
    all += plant.share;
  }
  std::ranges::stable_sort(others, std::ranges::greater{},
                           [&](const Plant& plant) { return plant.share * away(plant); });
  others.resize(std::min(others.size(), kMost));
  double kept = 0.0;
  for (const Plant& plant : others) {
    kept += plant.share;
  }
  std::vector<ModeOfAxis> known = model.values();
  for (Plant& plant : others) {
    plant.share *= all / kept;
    plant.modes = shared_with(known, plant.modes, kNothing * swing(model.values()));
    known.insert(known.end(), plant.modes.begin(), plant.modes.end());
  }
  return others;
}

bool agree(const std::vector<AxisModel>& models) {
  constexpr double kApart = 0.05;
  const auto main_log = [](const AxisModel& model) {
    return math::log(model.values().front().freq_hz);
  };
  const auto [least, most] = std::ranges::minmax(models, {}, main_log);
  return main_log(most) - main_log(least) < kApart;
}

AxisModel combine(const std::vector<AxisModel>& models) {
  if (models.size() == 1) {
    return models.front();
  }
  const std::vector<Measurement> all = measurements(models);
  if (all.empty()) {
    return with_others_as_plants(models);
  }
  // Means of gains say nothing where the records divide them among the modes in other ways.
  AxisModel mean = averaged(all);
  const Estimate& gain = mean.modes.front().gain;
  return gain.low < 0.0 && gain.high > 0.0 ? with_others_as_plants(models) : mean;
}

}  // namespace unflex::identify
