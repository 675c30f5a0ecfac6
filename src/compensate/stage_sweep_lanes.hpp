// The sweeps of LaneStages over the nodes of a window: states, pulls, the slope and the steps. The
// factorisation is a sweep of its own (stage_factor_lanes.hpp). stage_lanes.hpp comes before this
// and has the notation.

namespace unflex::compensate {

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::roll_out(double resting, StageArrays& at) const {
  const std::size_t size = state_size();
  for (std::size_t k = 0; k + 1 < at.nodes; ++k) {
    const double* const b = at.states.data() + k * size + base_place();
    double input = 0.0;
    if (is_prescribed(at, k)) {
      const std::array<double, 3> f = prescribed_feedback(at, k);
      input = f[0] * b[0] + f[1] * b[1] + f[2] * b[2];
      if (k + 3 == at.nodes) {
        input += resting / kRestingByJerk;
      }
    }
    at.inputs[k] = input;
    step(step_at(k), at.states.data() + k * size, input, at.states.data() + (k + 1) * size);
  }
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::evaluate(StageArrays& at) const {
  const std::size_t size = state_size();
  const std::size_t swing = base_place();
  const std::size_t models = model_places();
  Lanes cost = broadcast<Lanes>(0.0);
  double of_inputs = 0.0;
  for (std::size_t k = 0; k < at.nodes; ++k) {
    const double* const z = at.states.data() + k * size;
    const double* const b = z + swing;
    for (std::size_t q = 0; q < model_groups(); ++q) {
      const std::size_t place = k * models + kLanes * q;
      const Lanes share = load<Lanes>(share_.at(kLanes * q));
      const Lanes error = nozzle(z, q) - load<Lanes>(at.node_aim.data() + place);
      const Lanes pull = at.node_weight[k] * share * error;
      store(pull, at.node_pull.data() + place);
      cost = cost + pull * error;
      if (k + 1 < at.nodes) {
        const NodeStep& s = step_at(k);
        Lanes middle = at.inputs[k] * load<Lanes>(s.middle.input.at(kLanes * q));
        for (std::size_t i = 0; i < 3; ++i) {
          middle = middle + b[i] * load<Lanes>(s.middle.base.at(i * models + kLanes * q));
        }
        for (std::size_t i = 0; i < swing; ++i) {
          middle = middle + z[i] * load<Lanes>(s.middle.by_place.at(i * models + kLanes * q));
        }
        const Lanes off = middle - load<Lanes>(at.middle_aim.data() + place);
        const Lanes middle_pull = at.middle_weight[k] * share * off;
        store(middle_pull, at.middle_pull.data() + place);
        cost = cost + middle_pull * off;
      }
    }
    if (k + 1 < at.nodes) {
      of_inputs += at.inputs[k] * at.inputs[k];
    }
  }
  at.half_cost = 0.5 * (sum(cost) + jerk_weight_ * of_inputs);
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::change_aims(const double* node_aims, const double* middle_aims,
                                          double origin, double per_unit, StageArrays& at) const {
  const Lanes from = broadcast<Lanes>(origin);
  const std::size_t models = model_places();
  const auto change = [&](double weight, std::size_t place, std::size_t q, const double* to,
                          LaneArray& aim, LaneArray& pull) {
    const Lanes now = per_unit * (load<Lanes>(to + place) - from);
    const Lanes share = load<Lanes>(share_.at(kLanes * q));
    store(weight * share * (load<Lanes>(aim.data() + place) - now), pull.data() + place);
    store(now, aim.data() + place);
  };
  for (std::size_t k = 0; k < at.nodes; ++k) {
    for (std::size_t q = 0; q < model_groups(); ++q) {
      const std::size_t place = k * models + kLanes * q;
      change(at.node_weight[k], place, q, node_aims, at.node_aim, at.node_pull);
      if (k + 1 < at.nodes) {
        change(at.middle_weight[k], place, q, middle_aims, at.middle_aim, at.middle_pull);
      }
    }
  }
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::carry_slope_back(const PerKind<const double*>& forces,
                                               double faint_pull, bool pulled_by_inputs,
                                               StageArrays& at, double* slope) const {
  const std::size_t v_count = groups();
  const std::size_t size = state_size();
  const std::size_t models = model_places();
  const double* const jerk_force = forces[index_of(RowKind::jerk)];
  const double jerk_weight = pulled_by_inputs ? jerk_weight_ : 0.0;
  LaneRow<Lanes, 2 * V> g(2 * v_count);
  double gb[3] = {0.0, 0.0, 0.0};
  for (std::size_t v = 0; v < 2 * v_count; ++v) {
    g[v] = broadcast<Lanes>(0.0);
  }
  const auto add_node = [&](std::size_t k) {
    Lanes all = broadcast<Lanes>(0.0);
    for (std::size_t q = 0; q < model_groups(); ++q) {
      const Lanes pull = load<Lanes>(at.node_pull.data() + k * models + kLanes * q) -
                         faint_pull * load<Lanes>(is_model_.at(kLanes * q));
      double each[kLanes];
      store(pull, each);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        for (std::size_t v = 0; v < v_count; ++v) {
          g[v] = g[v] + each[lane] * load<Lanes>(by_model_.at(
                                         (kLanes * q + lane) * kLanes * v_count + kLanes * v));
        }
      }
      all = all + pull;
    }
    gb[0] += sum(all);
    for (std::size_t i = 0; i < 3; ++i) {
      if (forces[i] != nullptr) {
        gb[i] -= forces[i][k];
      }
    }
  };
  at.decrement = 0.0;
  add_node(at.nodes - 1);
  for (std::size_t k = at.nodes - 1; k-- > 0;) {
    const NodeStep& s = step_at(k);
    Lanes by_input = broadcast<Lanes>(0.0);
    Lanes by_accel = broadcast<Lanes>(0.0);
    for (std::size_t v = 0; v < v_count; ++v) {
      by_input = by_input + (jerk(s, 0, v) * g[v] + jerk(s, 1, v) * g[v_count + v]);
      by_accel = by_accel + (accel(s, 0, v) * g[v] + accel(s, 1, v) * g[v_count + v]);
    }
    Lanes of_base[2] = {broadcast<Lanes>(0.0), broadcast<Lanes>(0.0)};
    const double* const pulls = at.middle_pull.data() + k * models;
    for (std::size_t q = 0; q < model_groups(); ++q) {
      const Lanes pull = load<Lanes>(pulls + kLanes * q);
      by_input = by_input + pull * load<Lanes>(s.middle.input.at(kLanes * q));
      by_accel = by_accel + pull * load<Lanes>(s.middle.base.at(2 * models + kLanes * q));
      for (std::size_t i = 0; i < 2; ++i) {
        of_base[i] = of_base[i] + pull * load<Lanes>(s.middle.base.at(i * models + kLanes * q));
      }
    }
    const double down = jerk_weight * at.inputs[k] - (jerk_force != nullptr ? jerk_force[k] : 0.0) +
                        sum(by_input) + (kBaseByJerk[0] * gb[0] + kBaseByJerk[1] * gb[1] + gb[2]);
    at.feedforward[k] = -down * at.inverse_curvature[k];
    at.decrement -= 0.5 * down * at.feedforward[k];
    gb[2] = 0.5 * gb[0] + gb[1] + gb[2] + sum(by_accel);
    gb[1] += gb[0] + sum(of_base[1]);
    gb[0] += sum(of_base[0]);
    const double* const f = at.feedback.data() + k * size;
    for (std::size_t v = 0; v < v_count; ++v) {
      const Lanes y = g[v];
      const Lanes rate = g[v_count + v];
      g[v] = own(s, 0, v) * y + own(s, 2, v) * rate;
      g[v_count + v] = own(s, 1, v) * y + own(s, 3, v) * rate;
    }
    for (std::size_t c = 0; c < models; ++c) {
      for (std::size_t v = 0; v < 2 * v_count; ++v) {
        g[v] = g[v] +
               pulls[c] * load<Lanes>(s.middle.by_model.at(c * 2 * kLanes * v_count + kLanes * v));
      }
    }
    for (std::size_t v = 0; v < 2 * v_count; ++v) {
      g[v] = g[v] + down * load<Lanes>(f + kLanes * v);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      gb[i] += down * f[base_place() + i];
    }
    add_node(k);
  }
  for (std::size_t v = 0; v < 2 * v_count; ++v) {
    store(g[v], slope + kLanes * v);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    slope[base_place() + i] = gb[i];
  }
}

template <class Lanes, std::size_t V, std::size_t W>
template <class Take, class TakeInput>
void LaneStages<Lanes, V, W>::forward(const double* first, const StageArrays& at, const Take& take,
                                      const TakeInput& take_input) const {
  const std::size_t g = groups();
  LaneRow<Lanes, 2 * V> y(2 * g);
  double b[3];
  for (std::size_t v = 0; v < 2 * g; ++v) {
    y[v] = load<Lanes>(first + kLanes * v);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    b[i] = first[base_place() + i];
  }
  for (std::size_t k = 0;; ++k) {
    take(k, y, b);
    if (k + 1 == at.nodes) {
      return;
    }
    const NodeStep& s = step_at(k);
    const double* const f = at.feedback.data() + k * state_size();
    Lanes by_swing = broadcast<Lanes>(0.0);
    for (std::size_t v = 0; v < 2 * g; ++v) {
      by_swing = by_swing + load<Lanes>(f + kLanes * v) * y[v];
    }
    const double* const fb = f + base_place();
    const double input =
        sum(by_swing) + ((fb[0] * b[0] + fb[1] * b[1]) + (fb[2] * b[2] + at.feedforward[k]));
    take_input(k, input);
    for (std::size_t v = 0; v < g; ++v) {
      const Lanes place = y[v];
      const Lanes rate = y[g + v];
      y[v] = own(s, 0, v) * place + own(s, 1, v) * rate +
             (b[2] * accel(s, 0, v) + input * jerk(s, 0, v));
      y[g + v] = own(s, 2, v) * place + own(s, 3, v) * rate +
                 (b[2] * accel(s, 1, v) + input * jerk(s, 1, v));
    }
    b[0] += b[1] + 0.5 * b[2] + kBaseByJerk[0] * input;
    b[1] += b[2] + kBaseByJerk[1] * input;
    b[2] += input;
  }
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::step_forward(StageArrays& at) const {
  const std::size_t size = state_size();
  forward(
      at.state_steps.data(), at,
      [&](std::size_t k, const auto& swing, const double* base) {
        double* const to = at.state_steps.data() + k * size;
        for (std::size_t v = 0; v < 2 * groups(); ++v) {
          store(swing[v], to + kLanes * v);
        }
        for (std::size_t i = 0; i < 3; ++i) {
          to[base_place() + i] = base[i];
        }
        to[base_place() + 3] = 0.0;
      },
      [&](std::size_t k, double input) { at.input_steps[k] = input; });
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::go_forward(const double* first_step, StageArrays& at) const {
  const std::size_t size = state_size();
  forward(
      first_step, at,
      [&](std::size_t k, const auto& swing, const double* base) {
        double* const to = at.states.data() + k * size;
        for (std::size_t v = 0; v < 2 * groups(); ++v) {
          store(load<Lanes>(to + kLanes * v) + swing[v], to + kLanes * v);
        }
        for (std::size_t i = 0; i < 3; ++i) {
          to[base_place() + i] += base[i];
        }
      },
      [&](std::size_t k, double input) { at.inputs[k] += input; });
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::write_nozzles(double origin, double unit, const StageArrays& at,
                                            double* nozzles) const {
  const std::size_t size = state_size();
  for (std::size_t k = 0; k < at.nodes; ++k) {
    for (std::size_t q = 0; q < model_groups(); ++q) {
      store(broadcast<Lanes>(origin) + unit * nozzle(at.states.data() + k * size, q),
            nozzles + k * model_places() + kLanes * q);
    }
  }
}

}  // namespace unflex::compensate
