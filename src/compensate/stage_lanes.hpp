// The kernels of stage_kernel.hpp: their numbers, and the steps from one node to the next. The
// factorisation is in stage_factor_lanes.hpp, and the sweeps over all nodes are in
// stage_sweep_lanes.hpp. This file is included once for each kind of lanes (unflex/core/lanes.hpp).
// So it has templates over lanes alone, and includes nothing.
//
// Notation, in addition to stage_kernel.hpp:
//   V, W      groups of four modes and of four models; 0: known at run time only
//   P         the cost to go ½ zᵀ P z + gᵀ z: P_ss between swings, P_bs from a place of the base to
//             swings, P_bb
//   u, i      P a and P B: what acceleration and input add to the cost to go
//   c         Φᵀ P B + …, as in stage_form.hpp
//   f         feedback −c/R
//   m, μ      coefficients of z and of the input in the place p in the middle of an interval
//   s         an interval's Φ, B, m and μ, by the frequencies that the modes have there

namespace unflex::compensate {

// Numbers of a kernel: N of them, or any number.
template <class Lanes, std::size_t N>
class KernelNumbers {
 public:
  void assign_zeros(std::size_t /*count*/) { values_ = {}; }
  double& operator[](std::size_t i) { return values_[i]; }
  double operator[](std::size_t i) const { return values_[i]; }
  [[nodiscard]] double* at(std::size_t i) { return values_.data() + i; }
  [[nodiscard]] const double* at(std::size_t i) const { return values_.data() + i; }

 private:
  alignas(kLanes * sizeof(double)) std::array<double, N> values_;
};

template <class Lanes>
class KernelNumbers<Lanes, 0> {
 public:
  void assign_zeros(std::size_t count) {
    values_.resize(count);
    std::fill_n(values_.data(), count, 0.0);
  }
  double& operator[](std::size_t i) { return values_[i]; }
  double operator[](std::size_t i) const { return values_[i]; }
  [[nodiscard]] double* at(std::size_t i) { return values_.data() + i; }
  [[nodiscard]] const double* at(std::size_t i) const { return values_.data() + i; }

 private:
  LaneArray values_;
};

// Lanes while they are worked on: N groups of them, or any number.
template <class Lanes, std::size_t N>
struct LaneRow {
  explicit LaneRow(std::size_t /*count*/) {}
  Lanes& operator[](std::size_t i) { return values[i]; }
  const Lanes& operator[](std::size_t i) const { return values[i]; }
  Lanes values[N];
};

template <class Lanes>
struct LaneRow<Lanes, 0> {
  explicit LaneRow(std::size_t count) : values(new Lanes[count]) {}
  Lanes& operator[](std::size_t i) { return values[i]; }
  const Lanes& operator[](std::size_t i) const { return values[i]; }
  std::unique_ptr<Lanes[]> values;
};

template <class Lanes, std::size_t V, std::size_t W>
class LaneStages final : public StageKernel {
 public:
  LaneStages(std::size_t modes, std::size_t models)
      : groups_((modes + kLanes - 1) / kLanes), model_groups_((models + kLanes - 1) / kLanes) {}

  [[nodiscard]] std::size_t mode_places() const override { return kLanes * groups(); }
  [[nodiscard]] std::size_t model_places() const override { return kLanes * model_groups(); }
  [[nodiscard]] std::size_t state_size() const override { return 2 * mode_places() + kLanes; }
  [[nodiscard]] std::size_t base_place() const override { return 2 * mode_places(); }

  void assign(const StageModel& model) override {
    const std::size_t k = kLanes * groups();
    const std::size_t m = kLanes * model_groups();
    jerk_weight_ = model.jerk_weight;
    share_.assign_zeros(m);
    is_model_.assign_zeros(m);
    by_model_.assign_zeros(m * k);
    by_mode_.assign_zeros(k * m);
    node_square_.assign_zeros(k * k);
    node_cross_.assign_zeros(k);
    in_one_model_.assign(groups() * groups(), 0);
    cost_to_go_.assign_zeros(4 * k * k);
    base_to_go_.assign_zeros(3 * 2 * k);
    node_base_ = 0.0;
    for (std::size_t c = 0; c < model.models.size(); ++c) {
      add_model(c, model.models[c].parts, model.models[c].share);
    }
    step_of_ = model.step_of;
    steps_.resize(model.steps.size());
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      set_step(model.steps[i], model.models, steps_[i]);
    }
  }

  void roll_out(double resting, StageArrays& at) const override;

  bool factor(const PerKind<const double*>& weights, StageArrays& at) override;
  bool factor_and_keep(const PerKind<const double*>& weights, StageArrays& at) override;
  bool factor_between(std::size_t first, std::size_t last, const PerKind<const double*>& weights,
                      StageArrays& at) override;
  double cost_to_go(std::size_t row, std::size_t column) const override {
    const std::size_t swing = base_place();
    if (row < swing && column < swing) {
      return cost_to_go_[row * swing + column];
    }
    if (row < swing) {
      return base_to_go_[(column - swing) * swing + row];
    }
    return column < swing ? base_to_go_[(row - swing) * swing + column]
                          : base_square_[row - swing][column - swing];
  }

  void evaluate(StageArrays& at) const override;

  void change_aims(const double* node_aims, const double* middle_aims, double origin,
                   double per_unit, StageArrays& at) const override;

  void carry_slope_back(const PerKind<const double*>& forces, double faint_pull,
                        bool pulled_by_inputs, StageArrays& at, double* slope) const override;

  void step_forward(StageArrays& at) const override;

  void go_forward(const double* first_step, StageArrays& at) const override;

  void write_nozzles(double origin, double unit, const StageArrays& at,
                     double* nozzles) const override;

 private:
  [[nodiscard]] std::size_t groups() const {
    if constexpr (V > 0) {
      return V;
    } else {
      return groups_;
    }
  }
  [[nodiscard]] std::size_t model_groups() const {
    if constexpr (W > 0) {
      return W;
    } else {
      return model_groups_;
    }
  }

  template <std::size_t N>
  using Numbers = KernelNumbers<Lanes, N>;
  static constexpr std::size_t kK = kLanes * V;
  static constexpr std::size_t kM = kLanes * W;

  // p in the middle of an interval.
  struct Middle {
    // m of the swing, by models and by places; m of the base; and μ.
    Numbers<2 * kM * kK> by_model;
    Numbers<2 * kM * kK> by_place;
    Numbers<3 * kM> base;
    Numbers<kM> input;
    // Σ α of the squares of p.
    Numbers<4 * kK * kK> square;
    Numbers<6 * kK> by_base;
    std::array<std::array<double, 3>, 3> base_square{};
    // Σ α μ m and Σ α μ².
    Numbers<2 * kK> cross;
    std::array<double, 3> base_cross{};
    double curvature = 0.0;
  };

  // s: what depends on the modes' frequencies.
  struct NodeStep {
    Numbers<4 * kK> own;       // A, by parts
    Numbers<2 * kK> by_accel;  // a
    Numbers<2 * kK> by_jerk;   // β
    Middle middle;
  };

  // The step from node k to the next.
  [[nodiscard]] const NodeStep& step_at(std::size_t k) const {
    return steps_[step_of_.empty() ? 0 : step_of_[k]];
  }

  // Four modes' part of A, a and β.
  [[nodiscard]] Lanes own(const NodeStep& s, std::size_t part, std::size_t v) const {
    return load<Lanes>(s.own.at(kLanes * (part * groups() + v)));
  }
  [[nodiscard]] Lanes accel(const NodeStep& s, std::size_t part, std::size_t v) const {
    return load<Lanes>(s.by_accel.at(kLanes * (part * groups() + v)));
  }
  [[nodiscard]] Lanes jerk(const NodeStep& s, std::size_t part, std::size_t v) const {
    return load<Lanes>(s.by_jerk.at(kLanes * (part * groups() + v)));
  }
  [[nodiscard]] double* to_go(std::size_t row, std::size_t v) {
    return cost_to_go_.at(row * base_place() + kLanes * v);
  }
  [[nodiscard]] double* base_to_go(std::size_t i, std::size_t v) {
    return base_to_go_.at(i * base_place() + kLanes * v);
  }

  [[nodiscard]] static bool is_prescribed(const StageArrays& at, std::size_t k) {
    return at.rests_at_end && k + 3 >= at.nodes;
  }
  // The prescribed feedback of b, ḃ and b̈ (stage_form.hpp).
  [[nodiscard]] static std::array<double, 3> prescribed_feedback(const StageArrays& at,
                                                                 std::size_t k) {
    if (k + 2 == at.nodes) {
      return {0.0, -2.0, -2.0};
    }
    // (1, 2/3, 1/6) Φ
    return {-1.0 / kRestingByJerk, -(1.0 + 2.0 / 3.0) / kRestingByJerk,
            -(0.5 + 2.0 / 3.0 + 1.0 / 6.0) / kRestingByJerk};
  }

  // What a model is at the nodes.
  void add_model(std::size_t c, const std::vector<SharedModes::Part>& parts, double share) {
    const std::size_t k = mode_places();
    const std::size_t models = model_places();
    std::vector<double> place(k);
    for (const auto& [i, gain] : parts) {
      for (const auto& [other, other_gain] : parts) {
        in_one_model_[i / kLanes * groups() + other / kLanes] = 1;
      }
      place[i] += gain;
      by_model_[c * k + i] += gain;
      by_mode_[i * models + c] += gain;
    }
    share_[c] = share;
    is_model_[c] = 1.0;
    for (std::size_t i = 0; i < k; ++i) {
      node_cross_[i] += share * place[i];
      for (std::size_t j = 0; j < k; ++j) {
        node_square_[i * k + j] += share * place[i] * place[j];
      }
    }
    node_base_ += share;
  }

  void set_step(const ModeSteps& modes, const std::vector<SharedModes::Model>& models,
                NodeStep& s) const {
    const std::size_t k = mode_places();
    const std::size_t m = model_places();
    s.own.assign_zeros(4 * k);
    s.by_accel.assign_zeros(2 * k);
    s.by_jerk.assign_zeros(2 * k);
    for (std::size_t i = 0; i < modes.count(); ++i) {
      for (std::size_t part = 0; part < 4; ++part) {
        s.own[part * k + i] = modes.own[part][i];
      }
      for (std::size_t part = 0; part < 2; ++part) {
        s.by_accel[part * k + i] = modes.by_accel[part][i];
        s.by_jerk[part * k + i] = modes.by_jerk[part][i];
      }
    }
    s.middle.by_model.assign_zeros(m * 2 * k);
    s.middle.by_place.assign_zeros(2 * k * m);
    s.middle.base.assign_zeros(3 * m);
    s.middle.input.assign_zeros(m);
    s.middle.square.assign_zeros(4 * k * k);
    s.middle.by_base.assign_zeros(3 * 2 * k);
    s.middle.cross.assign_zeros(2 * k);
    s.middle.base_square = {};
    s.middle.base_cross = {};
    s.middle.curvature = 0.0;
    for (std::size_t c = 0; c < models.size(); ++c) {
      add_middle(c, models[c].parts, models[c].share, s);
    }
  }

  // What a model is in the middle of an interval.
  void add_middle(std::size_t c, const std::vector<SharedModes::Part>& parts, double share,
                  NodeStep& s) const {
    const std::size_t k = mode_places();
    const std::size_t models = model_places();
    const std::size_t swing = 2 * k;
    std::vector<double> place(swing + 3);
    std::vector<double> rate(swing + 3);
    place[swing] = 1.0;
    rate[swing + 1] = 1.0;
    for (const auto& [i, gain] : parts) {
      place[i] += gain;
      rate[k + i] += gain;
    }
    // p = (p₁ + p₂)/2 + (ṗ₁ − ṗ₂)/8.
    std::vector<double> middle(swing + 3);
    for (std::size_t i = 0; i < middle.size(); ++i) {
      middle[i] = 0.5 * place[i] - 0.125 * rate[i];
    }
    const double input = by_input(s, middle.data());
    transpose_step(s, middle.data());
    for (std::size_t i = 0; i < middle.size(); ++i) {
      middle[i] += 0.5 * place[i] + 0.125 * rate[i];
    }
    s.middle.input[c] = input;
    for (std::size_t i = 0; i < swing; ++i) {
      s.middle.by_model[c * swing + i] = middle[i];
      s.middle.by_place[i * models + c] = middle[i];
      s.middle.cross[i] += share * input * middle[i];
      for (std::size_t j = 0; j < swing; ++j) {
        s.middle.square[i * swing + j] += share * middle[i] * middle[j];
      }
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double of_base = middle[swing + i];
      s.middle.base[i * models + c] = of_base;
      s.middle.base_cross[i] += share * input * of_base;
      for (std::size_t j = 0; j < swing; ++j) {
        s.middle.by_base[i * swing + j] += share * of_base * middle[j];
      }
      for (std::size_t j = 0; j < 3; ++j) {
        s.middle.base_square[i][j] += share * of_base * middle[swing + j];
      }
    }
    s.middle.curvature += share * input * input;
  }

  // Bᵀ v
  [[nodiscard]] double by_input(const NodeStep& s, const double* v) const {
    const std::size_t k = mode_places();
    const double* const b = v + 2 * k;
    double result = kBaseByJerk[0] * b[0] + kBaseByJerk[1] * b[1] + kBaseByJerk[2] * b[2];
    for (std::size_t i = 0; i < k; ++i) {
      result += s.by_jerk[i] * v[i] + s.by_jerk[k + i] * v[k + i];
    }
    return result;
  }

  // v ← Φᵀ v
  void transpose_step(const NodeStep& s, double* v) const {
    const std::size_t k = mode_places();
    double* const b = v + 2 * k;
    double of_accel = 0.5 * b[0] + b[1] + b[2];
    for (std::size_t i = 0; i < k; ++i) {
      const double y = v[i];
      const double rate = v[k + i];
      of_accel += s.by_accel[i] * y + s.by_accel[k + i] * rate;
      v[i] = s.own[i] * y + s.own[2 * k + i] * rate;
      v[k + i] = s.own[k + i] * y + s.own[3 * k + i] * rate;
    }
    b[1] += b[0];
    b[2] = of_accel;
  }

  // z_{k+1} from z_k and j_k.
  void step(const NodeStep& s, const double* z, double input, double* next) const {
    const std::size_t g = groups();
    const double* const b = z + base_place();
    double* const to = next + base_place();
    for (std::size_t v = 0; v < g; ++v) {
      const Lanes y = load<Lanes>(z + kLanes * v);
      const Lanes rate = load<Lanes>(z + kLanes * (g + v));
      store(
          own(s, 0, v) * y + own(s, 1, v) * rate + (b[2] * accel(s, 0, v) + input * jerk(s, 0, v)),
          next + kLanes * v);
      store(
          own(s, 2, v) * y + own(s, 3, v) * rate + (b[2] * accel(s, 1, v) + input * jerk(s, 1, v)),
          next + kLanes * (g + v));
    }
    to[0] = b[0] + b[1] + 0.5 * b[2] + kBaseByJerk[0] * input;
    to[1] = b[1] + b[2] + kBaseByJerk[1] * input;
    to[2] = b[2] + input;
    to[3] = 0.0;
  }

  // p of four models.
  [[nodiscard]] Lanes nozzle(const double* z, std::size_t q) const {
    Lanes p = broadcast<Lanes>(z[base_place()]);
    for (std::size_t i = 0; i < kLanes * groups(); ++i) {
      p = p + z[i] * load<Lanes>(by_mode_.at(i * model_places() + kLanes * q));
    }
    return p;
  }

  void add_rows(const PerKind<const double*>& weights, std::size_t k) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (weights[i] != nullptr) {
        base_square_[i][i] += weights[i][k];
      }
    }
  }

  // stage_factor_lanes.hpp defines these.
  void begin_at_end(const PerKind<const double*>& weights, const StageArrays& at);
  [[nodiscard]] std::size_t kept_size() const {
    return 4 * mode_places() * mode_places() + 3 * 2 * mode_places() + 9;
  }
  void keep(std::size_t k);
  void take_kept(std::size_t k);
  bool carry_cost_back(std::size_t k, const PerKind<const double*>& weights, StageArrays& at);
  void carry_swing_back(const NodeStep& s, const double* f, const LaneRow<Lanes, 2 * V>& c,
                        double middle, double node);
  template <bool kCosts>
  void carry_block_back(const NodeStep& s, std::size_t a, std::size_t v, const double* f,
                        const LaneRow<Lanes, 2 * V>& c, double middle, double node);
  void carry_cross_back(const NodeStep& s, const LaneRow<Lanes, 2 * V>& u,
                        const LaneRow<Lanes, 2 * V>& c, const double* fb, double middle,
                        double node);

  // stage_sweep_lanes.hpp defines this. Calls take(k, swing, base) with the step of each node, and
  // take_input(k, input) with the step of each input.
  template <class Take, class TakeInput>
  void forward(const double* first, const StageArrays& at, const Take& take,
               const TakeInput& take_input) const;

  std::size_t groups_ = 0;
  std::size_t model_groups_ = 0;
  double jerk_weight_ = 0.0;
  std::vector<NodeStep> steps_;
  std::vector<std::uint32_t> step_of_;  // as in StageModel
  Numbers<kM> share_;                   // α
  Numbers<kM> is_model_;                // 1, and 0 in a lane without a model
  // A mode's gain in a model, by models and by modes.
  Numbers<kM * kK> by_model_;
  Numbers<kM * kK> by_mode_;
  // Σ α of the squares of p at nodes, where only the places of the swing count.
  Numbers<kK * kK> node_square_;
  Numbers<kK> node_cross_;
  double node_base_ = 0.0;
  std::vector<char> in_one_model_;   // whether some model has modes of both groups
  Numbers<4 * kK * kK> cost_to_go_;  // P_ss
  Numbers<6 * kK> base_to_go_;       // P_bs
  std::array<std::array<double, 3>, 3> base_square_{};
  std::vector<double> kept_;  // P of every kKeptNodes-th node, kept_size() numbers each
};

template <class Lanes, std::size_t V, std::size_t W>
std::unique_ptr<StageKernel> make_lane_stages(std::size_t modes, std::size_t models) {
  return std::make_unique<LaneStages<Lanes, V, W>>(modes, models);
}

// The smallest kernel that has room.
template <class Lanes>
std::unique_ptr<StageKernel> fitting_stages(std::size_t modes, std::size_t models) {
  struct Choice {
    std::size_t modes;
    std::size_t models;
    std::unique_ptr<StageKernel> (*make)(std::size_t, std::size_t);
  };
  constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
  constexpr Choice kChoices[] = {
      {4, 4, make_lane_stages<Lanes, 1, 1>},     {8, 4, make_lane_stages<Lanes, 2, 1>},
      {8, 8, make_lane_stages<Lanes, 2, 2>},     {12, 4, make_lane_stages<Lanes, 3, 1>},
      {12, 8, make_lane_stages<Lanes, 3, 2>},    {12, 12, make_lane_stages<Lanes, 3, 3>},
      {16, kAny, make_lane_stages<Lanes, 4, 0>}, {20, kAny, make_lane_stages<Lanes, 5, 0>},
      {24, kAny, make_lane_stages<Lanes, 6, 0>}, {28, kAny, make_lane_stages<Lanes, 7, 0>},
      {32, kAny, make_lane_stages<Lanes, 8, 0>},
  };
  for (const Choice& choice : kChoices) {
    if (modes <= choice.modes && models <= choice.models) {
      return choice.make(modes, models);
    }
  }
  return make_lane_stages<Lanes, 0, 0>(modes, models);
}

}  // namespace unflex::compensate
