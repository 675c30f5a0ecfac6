#include "fit_model.hpp"

#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

FitModel::FitModel(const Log& log) {
  const double start_s = log.samples.front().time_s;
  first_power_ = log.samples.front().power;
  double power = first_power_;
  for (const Sample& sample : log.samples) {
    const double time_s = sample.time_s - start_s;
    if (sample.power != power) {
      power = sample.power;
      const double change_s = log.hold == Hold::to_next ? time_s : 0.5 * (time_s + time_s_.back());
      changes_.push_back({change_s, power});
    }
    time_s_.push_back(time_s);
  }
}

Eigen::MatrixXd FitModel::columns(const Lags& lags, const Beginning& beginning,
                                  bool with_ambient) const {
  const Eigen::Index driven = 0;
  const Eigen::Index states = beginning.at_rest ? 0 : 2;
  Eigen::MatrixXd columns(size(), 1 + states + (with_ambient ? 1 : 0));
  double now_s = 0.0;
  double block = 0.0;
  double sensor = 0.0;
  double felt = beginning.power_before;
  ExactStep step;
  double step_s = -1.0;
  const auto go_to = [&](double time_s) {
    if (time_s - now_s != step_s) {
      step_s = time_s - now_s;
      step = exact_step(lags.time_constant_s, lags.sensor_lag_s, step_s);
    }
    const double off = block - felt;
    sensor = felt + step.sensor * (sensor - felt) + step.cross * off;
    block = felt + step.block * off;
    now_s = time_s;
  };
  // The block first feels the change from the power before the log to the log's first power.
  std::size_t next = 0;
  const auto next_s = [&] {
    return lags.dead_time_s + (next == 0 ? 0.0 : changes_[next - 1].time_s);
  };
  for (Eigen::Index k = 0; k < size(); ++k) {
    const double time_s = time_s_[static_cast<std::size_t>(k)];
    while (next <= changes_.size() && next_s() <= time_s) {
      go_to(next_s());
      felt = next == 0 ? first_power_ : changes_[next - 1].power;
      ++next;
    }
    go_to(time_s);
    columns(k, driven) = sensor;
    if (!beginning.at_rest) {
      const ExactStep all = exact_step(lags.time_constant_s, lags.sensor_lag_s, time_s);
      columns(k, driven + 1) = all.cross;
      columns(k, driven + 2) = all.sensor;
    }
  }
  if (with_ambient) {
    columns.rightCols(1).setOnes();
  }
  return columns;
}

}  // namespace unflex::hotend
