// Recordings of accelerometers, and the modes that are fitted to them.
#include <array>
#include <cmath>
#include <string>

#include "bytes.hpp"
#include "text_checks.hpp"
#include "unflex/identify/axis_model.hpp"

namespace unflex::fuzz {
namespace {

void check_estimate(const identify::Estimate& estimate) {
  require(std::isfinite(estimate.value) && estimate.value > 0.0, "an estimate of no value");
  require(estimate.low <= estimate.value && estimate.value <= estimate.high,
          "an estimate outside its interval");
}

void check_model(const identify::AxisModel& model) {
  double gains = 0.0;
  for (const identify::ModeEstimate& mode : model.modes) {
    check_estimate(mode.freq_hz);
    check_estimate(mode.damping_ratio);
    require(mode.damping_ratio.value < 1.0, "a mode that does not ring");
    gains += mode.gain.value;
  }
  require(std::abs(gains - 1.0) < 1e-6, "gains that do not add up to 1");
  double shares = 0.0;
  for (const identify::Plant& plant : model.plants) {
    shares += plant.share;
  }
  require(std::abs(shares - 1.0) < 1e-6, "shares that do not add up to 1");
  require(identify::other_plants(model).size() < model.plants.size(), "a plant too many");
}

void check_fit(const identify::RecordFit& fit) {
  require(fit.unexplained >= 0.0 && fit.unexplained <= 1.0, "a share beyond 0 to 1");
  require(fit.curve.measured.size() == fit.curve.x.size() &&
              fit.curve.fitted.size() == fit.curve.x.size(),
          "a curve in parts of different lengths");
  for (const std::string& warning : fit.warnings) {
    require_one_line(warning);
  }
  if (fit.is_trusted()) {
    check_model(fit.model);
  } else {
    require_one_line(fit.refusal);
  }
}

}  // namespace

void records(std::string_view bytes) {
  constexpr std::array<const char*, 4> kNames = {"raw_data_x_1.csv", "resonances_y_2.csv",
                                                 "raw_data_axis=1.000,-1.000_b.csv", "0.csv"};
  Bytes source(bytes);
  const std::string name = kNames[source.variant(kNames.size())];
  const Result<std::vector<identify::DataSet>> sets = identify::parse_records(source.rest(), name);
  if (!sets) {
    return require_fault_of_input(sets.error());
  }
  std::vector<identify::AxisModel> models;
  for (const identify::DataSet& set : *sets) {
    for (const std::string& note : set.notes) {
      require_one_line(note);
    }
    const Result<identify::RecordFit> fit =
        identify::fit(set, set.axis.value_or(identify::dominant_axis(set)), {});
    if (!fit) {
      require_fault_of_input(fit.error());
      continue;
    }
    check_fit(*fit);
    if (fit->is_trusted()) {
      models.push_back(fit->model);
    }
  }
  if (models.size() > 1) {
    check_model(identify::combine(models));
  }
}

}  // namespace unflex::fuzz
