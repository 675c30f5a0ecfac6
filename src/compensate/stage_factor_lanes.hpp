// The factorisation of LaneStages: the cost to go and the feedback, from the last stage to the
// first. stage_lanes.hpp comes before this and has the notation.

namespace unflex::compensate {

template <class Lanes, std::size_t V, std::size_t W>
bool LaneStages<Lanes, V, W>::factor(const PerKind<const double*>& weights, StageArrays& at) {
  begin_at_end(weights, at);
  for (std::size_t k = at.nodes - 1; k-- > 0;) {
    if (!carry_cost_back(k, weights, at)) {
      return false;
    }
  }
  return true;
}

template <class Lanes, std::size_t V, std::size_t W>
bool LaneStages<Lanes, V, W>::factor_and_keep(const PerKind<const double*>& weights,
                                              StageArrays& at) {
  kept_.resize(((at.nodes - 1) / kKeptNodes + 1) * kept_size());
  begin_at_end(weights, at);
  for (std::size_t k = at.nodes - 1; k-- > 0;) {
    if (!carry_cost_back(k, weights, at)) {
      return false;
    }
    if (k % kKeptNodes == 0) {
      keep(k);
    }
  }
  return true;
}

template <class Lanes, std::size_t V, std::size_t W>
bool LaneStages<Lanes, V, W>::factor_between(std::size_t first, std::size_t last,
                                             const PerKind<const double*>& weights,
                                             StageArrays& at) {
  if (last + 1 == at.nodes) {
    begin_at_end(weights, at);
  } else {
    take_kept(last);
  }
  for (std::size_t k = last; k-- > first;) {
    if (!carry_cost_back(k, weights, at)) {
      return false;
    }
  }
  return true;
}

// P of the last node.
template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::begin_at_end(const PerKind<const double*>& weights,
                                           const StageArrays& at) {
  const std::size_t g = groups();
  const double last = at.node_weight[at.nodes - 1];
  const std::size_t k_places = kLanes * g;
  cost_to_go_.assign_zeros(4 * k_places * k_places);
  base_to_go_.assign_zeros(3 * 2 * k_places);
  for (std::size_t i = 0; i < k_places; ++i) {
    for (std::size_t v = 0; v < g; ++v) {
      store(last * load<Lanes>(node_square_.at(i * k_places + kLanes * v)), to_go(i, v));
    }
  }
  for (std::size_t v = 0; v < g; ++v) {
    store(last * load<Lanes>(node_cross_.at(kLanes * v)), base_to_go(0, v));
  }
  base_square_ = {};
  base_square_[0][0] = last * node_base_;
  add_rows(weights, at.nodes - 1);
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::keep(std::size_t k) {
  const std::size_t square = 4 * mode_places() * mode_places();
  const std::size_t cross = 3 * 2 * mode_places();
  double* const to = kept_.data() + k / kKeptNodes * kept_size();
  std::copy_n(cost_to_go_.at(0), square, to);
  std::copy_n(base_to_go_.at(0), cross, to + square);
  for (std::size_t i = 0; i < 3; ++i) {
    std::copy_n(base_square_[i].data(), 3, to + square + cross + 3 * i);
  }
}

template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::take_kept(std::size_t k) {
  const std::size_t square = 4 * mode_places() * mode_places();
  const std::size_t cross = 3 * 2 * mode_places();
  const double* const from = kept_.data() + k / kKeptNodes * kept_size();
  std::copy_n(from, square, cost_to_go_.at(0));
  std::copy_n(from + square, cross, base_to_go_.at(0));
  for (std::size_t i = 0; i < 3; ++i) {
    std::copy_n(from + square + cross + 3 * i, 3, base_square_[i].data());
  }
}

// Carries P back over an interval, and computes the interval's feedback.
template <class Lanes, std::size_t V, std::size_t W>
bool LaneStages<Lanes, V, W>::carry_cost_back(std::size_t k, const PerKind<const double*>& weights,
                                              StageArrays& at) {
  const std::size_t g = groups();
  const std::size_t places = kLanes * g;
  const NodeStep& s = step_at(k);
  const double* const jerk_weight = weights[index_of(RowKind::jerk)];
  const double middle = at.middle_weight[k];
  const double node = at.node_weight[k];
  auto& pbb = base_square_;
  LaneRow<Lanes, 2 * V> u(2 * g);
  LaneRow<Lanes, 2 * V> in(2 * g);
  for (std::size_t v = 0; v < 2 * g; ++v) {
    const Lanes p0 = load<Lanes>(base_to_go(0, v));
    const Lanes p1 = load<Lanes>(base_to_go(1, v));
    const Lanes p2 = load<Lanes>(base_to_go(2, v));
    u[v] = 0.5 * p0 + p1 + p2;
    in[v] = kBaseByJerk[0] * p0 + kBaseByJerk[1] * p1 + p2;
  }
  for (std::size_t i = 0; i < places; ++i) {
    for (std::size_t v = 0; v < 2 * g; ++v) {
      const Lanes of_place = load<Lanes>(to_go(i, v));
      const Lanes of_rate = load<Lanes>(to_go(places + i, v));
      u[v] = u[v] + (s.by_accel[i] * of_place + s.by_accel[places + i] * of_rate);
      in[v] = in[v] + (s.by_jerk[i] * of_place + s.by_jerk[places + i] * of_rate);
    }
  }
  double u_base[3];
  double in_base[3];
  for (std::size_t i = 0; i < 3; ++i) {
    Lanes of_accel = broadcast<Lanes>(0.0);
    Lanes of_input = broadcast<Lanes>(0.0);
    for (std::size_t v = 0; v < g; ++v) {
      const Lanes place = load<Lanes>(base_to_go(i, v));
      const Lanes rate = load<Lanes>(base_to_go(i, g + v));
      of_accel = of_accel + (accel(s, 0, v) * place + accel(s, 1, v) * rate);
      of_input = of_input + (jerk(s, 0, v) * place + jerk(s, 1, v) * rate);
    }
    u_base[i] = sum(of_accel) + (0.5 * pbb[i][0] + pbb[i][1] + pbb[i][2]);
    in_base[i] =
        sum(of_input) + (kBaseByJerk[0] * pbb[i][0] + kBaseByJerk[1] * pbb[i][1] + pbb[i][2]);
  }
  Lanes of_input = broadcast<Lanes>(0.0);
  Lanes of_accel = broadcast<Lanes>(0.0);
  Lanes accel_square = broadcast<Lanes>(0.0);
  LaneRow<Lanes, 2 * V> c(2 * g);
  for (std::size_t v = 0; v < g; ++v) {
    of_input = of_input + (jerk(s, 0, v) * in[v] + jerk(s, 1, v) * in[g + v]);
    of_accel = of_accel + (accel(s, 0, v) * in[v] + accel(s, 1, v) * in[g + v]);
    accel_square = accel_square + (accel(s, 0, v) * u[v] + accel(s, 1, v) * u[g + v]);
    c[v] = own(s, 0, v) * in[v] + own(s, 2, v) * in[g + v] +
           middle * load<Lanes>(s.middle.cross.at(kLanes * v));
    c[g + v] = own(s, 1, v) * in[v] + own(s, 3, v) * in[g + v] +
               middle * load<Lanes>(s.middle.cross.at(kLanes * (g + v)));
  }
  const double curvature =
      jerk_weight_ + (jerk_weight != nullptr ? jerk_weight[k] : 0.0) + sum(of_input) +
      (kBaseByJerk[0] * in_base[0] + kBaseByJerk[1] * in_base[1] + in_base[2]) +
      middle * s.middle.curvature;
  if (!(curvature > 0.0)) {
    return false;
  }
  double cb[3] = {
      in_base[0] + middle * s.middle.base_cross[0],
      in_base[0] + in_base[1] + middle * s.middle.base_cross[1],
      0.5 * in_base[0] + in_base[1] + in_base[2] + sum(of_accel) + middle * s.middle.base_cross[2]};
  // Computes the feedback. A prescribed feedback has entries for the base alone, so it adds nothing
  // to P_ss.
  double* const f = at.feedback.data() + k * state_size();
  double fb[3];
  double inverse = 0.0;
  const bool prescribed = is_prescribed(at, k);
  if (prescribed) {
    const std::array<double, 3> given = prescribed_feedback(at, k);
    for (std::size_t i = 0; i < 3; ++i) {
      fb[i] = given[i];
      cb[i] += 0.5 * curvature * fb[i];
    }
  } else {
    inverse = 1.0 / curvature;
    for (std::size_t i = 0; i < 3; ++i) {
      fb[i] = -inverse * cb[i];
    }
  }
  at.inverse_curvature[k] = inverse;
  for (std::size_t v = 0; v < 2 * g; ++v) {
    store(-inverse * c[v], f + kLanes * v);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    f[base_place() + i] = fb[i];
  }
  carry_swing_back(s, f, c, middle, node);
  carry_cross_back(s, u, c, fb, middle, node);
  double next[3][3];
  next[0][0] = pbb[0][0];
  next[0][1] = pbb[0][0] + pbb[0][1];
  next[0][2] = u_base[0];
  next[1][1] = pbb[0][0] + 2.0 * pbb[0][1] + pbb[1][1];
  next[1][2] = u_base[0] + u_base[1];
  next[2][2] = 0.5 * u_base[0] + u_base[1] + u_base[2] + sum(accel_square);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      next[i][j] += middle * s.middle.base_square[i][j] +
                    (prescribed ? cb[i] * fb[j] + fb[i] * cb[j] : fb[i] * cb[j]);
      pbb[i][j] = pbb[j][i] = next[i][j];
    }
  }
  pbb[0][0] += node * node_base_;
  add_rows(weights, k);
  return true;
}

// P_ss ← Φᵀ P_ss Φ + … + f cᵀ. Four rows of places and of rates at a time, from their own columns
// on; what lies before these is their mirror image.
template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::carry_swing_back(const NodeStep& s, const double* f,
                                               const LaneRow<Lanes, 2 * V>& c, double middle,
                                               double node) {
  const std::size_t g = groups();
  for (std::size_t a = 0; a < g; ++a) {
    for (std::size_t v = a; v < g; ++v) {
      if (in_one_model_[a * g + v] != 0) {
        carry_block_back<true>(s, a, v, f, c, middle, node);
      } else {
        carry_block_back<false>(s, a, v, f, c, middle, node);
      }
    }
  }
}

// Four modes' rows and four modes' columns of the new P_ss. kCosts: whether some model has modes of
// both, so that the stage's own cost has products of them.
template <class Lanes, std::size_t V, std::size_t W>
template <bool kCosts>
void LaneStages<Lanes, V, W>::carry_block_back(const NodeStep& s, std::size_t a, std::size_t v,
                                               const double* f, const LaneRow<Lanes, 2 * V>& c,
                                               double middle, double node) {
  const std::size_t g = groups();
  const std::size_t places = kLanes * g;
  const std::size_t swing = 2 * places;
  const Lanes o0 = own(s, 0, v);
  const Lanes o1 = own(s, 1, v);
  const Lanes o2 = own(s, 2, v);
  const Lanes o3 = own(s, 3, v);
  Lanes block[4][kLanes];  // from places and rates to places and rates
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::size_t i = kLanes * a + lane;
    const std::size_t r = places + i;
    const Lanes pp = load<Lanes>(to_go(i, v));
    const Lanes pr = load<Lanes>(to_go(i, g + v));
    const Lanes rp = load<Lanes>(to_go(r, v));
    const Lanes rr = load<Lanes>(to_go(r, g + v));
    const Lanes place_p = o0 * pp + o2 * pr;
    const Lanes place_r = o1 * pp + o3 * pr;
    const Lanes rate_p = o0 * rp + o2 * rr;
    const Lanes rate_r = o1 * rp + o3 * rr;
    const double own_0 = s.own[i];
    const double own_1 = s.own[places + i];
    const double own_2 = s.own[2 * places + i];
    const double own_3 = s.own[3 * places + i];
    block[0][lane] = own_0 * place_p + own_2 * rate_p + f[i] * c[v];
    block[1][lane] = own_0 * place_r + own_2 * rate_r + f[i] * c[g + v];
    block[2][lane] = own_1 * place_p + own_3 * rate_p + f[r] * c[v];
    block[3][lane] = own_1 * place_r + own_3 * rate_r + f[r] * c[g + v];
    if constexpr (kCosts) {
      const auto square = [&](std::size_t row, std::size_t group) {
        return middle * load<Lanes>(s.middle.square.at(row * swing + kLanes * group));
      };
      block[0][lane] =
          block[0][lane] +
          (square(i, v) + node * load<Lanes>(node_square_.at(i * places + kLanes * v)));
      block[1][lane] = block[1][lane] + square(i, g + v);
      block[2][lane] = block[2][lane] + square(r, v);
      block[3][lane] = block[3][lane] + square(r, g + v);
    }
    store(block[0][lane], to_go(i, v));
    store(block[1][lane], to_go(i, g + v));
    store(block[2][lane], to_go(r, v));
    store(block[3][lane], to_go(r, g + v));
  }
  if (v > a) {
    for (auto& quarter : block) {
      transpose(quarter[0], quarter[1], quarter[2], quarter[3]);
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = kLanes * v + lane;
      store(block[0][lane], to_go(i, a));
      store(block[2][lane], to_go(i, g + a));
      store(block[1][lane], to_go(places + i, a));
      store(block[3][lane], to_go(places + i, g + a));
    }
  }
}

// Carries P_bs back over an interval.
template <class Lanes, std::size_t V, std::size_t W>
void LaneStages<Lanes, V, W>::carry_cross_back(const NodeStep& s, const LaneRow<Lanes, 2 * V>& u,
                                               const LaneRow<Lanes, 2 * V>& c, const double* fb,
                                               double middle, double node) {
  const std::size_t g = groups();
  const std::size_t swing = base_place();
  for (std::size_t v = 0; v < g; ++v) {
    const Lanes place_0 = load<Lanes>(base_to_go(0, v));
    const Lanes rate_0 = load<Lanes>(base_to_go(0, g + v));
    const Lanes place_1 = place_0 + load<Lanes>(base_to_go(1, v));
    const Lanes rate_1 = rate_0 + load<Lanes>(base_to_go(1, g + v));
    const auto carry = [&](std::size_t i, const Lanes& place, const Lanes& rate) {
      Lanes next_place =
          own(s, 0, v) * place + own(s, 2, v) * rate +
          (middle * load<Lanes>(s.middle.by_base.at(i * swing + kLanes * v)) + fb[i] * c[v]);
      if (i == 0) {
        next_place = next_place + node * load<Lanes>(node_cross_.at(kLanes * v));
      }
      store(next_place, base_to_go(i, v));
      store(own(s, 1, v) * place + own(s, 3, v) * rate +
                (middle * load<Lanes>(s.middle.by_base.at(i * swing + kLanes * (g + v))) +
                 fb[i] * c[g + v]),
            base_to_go(i, g + v));
    };
    carry(0, place_0, rate_0);
    carry(1, place_1, rate_1);
    carry(2, u[v], u[g + v]);
  }
}

}  // namespace unflex::compensate
