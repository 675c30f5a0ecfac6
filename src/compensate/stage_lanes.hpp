// The kernels of stage_kernel.hpp. Included once for each kind of lanes (unflex/core/lanes.hpp), so
// there is nothing here but templates over lanes, and nothing is included.
//
// Notation, beside that of stage_kernel.hpp:
//   V, W      groups of four modes and of four models; 0: known at run time only
//   P         the cost to go ½ zᵀ P z + gᵀ z: P_ss between swings, P_bs from a place of the base to
//             swings, P_bb
//   u, i      P a and P B: what acceleration and input add to the cost to go
//   c         Φᵀ P B + …, as in stage_form.hpp
//   f         feedback −c/R
//   m, μ      coefficients of z and of the input in p in the middle of an interval

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
    own_.assign_zeros(4 * k);
    by_accel_.assign_zeros(2 * k);
    by_jerk_.assign_zeros(2 * k);
    for (std::size_t i = 0; i < model.modes.count(); ++i) {
      for (std::size_t part = 0; part < 4; ++part) {
        own_[part * k + i] = model.modes.own[part][i];
      }
      for (std::size_t part = 0; part < 2; ++part) {
        by_accel_[part * k + i] = model.modes.by_accel[part][i];
        by_jerk_[part * k + i] = model.modes.by_jerk[part][i];
      }
    }
    share_.assign_zeros(m);
    is_model_.assign_zeros(m);
    by_model_.assign_zeros(m * k);
    by_mode_.assign_zeros(k * m);
    middle_by_model_.assign_zeros(m * 2 * k);
    middle_by_place_.assign_zeros(2 * k * m);
    middle_base_.assign_zeros(3 * m);
    middle_input_.assign_zeros(m);
    node_square_.assign_zeros(k * k);
    node_cross_.assign_zeros(k);
    middle_square_.assign_zeros(4 * k * k);
    in_one_model_.assign(groups() * groups(), 0);
    middle_by_base_.assign_zeros(3 * 2 * k);
    middle_cross_.assign_zeros(2 * k);
    cost_to_go_.assign_zeros(4 * k * k);
    base_to_go_.assign_zeros(3 * 2 * k);
    node_base_ = 0.0;
    middle_base_square_ = {};
    middle_base_cross_ = {};
    middle_curvature_ = 0.0;
    for (std::size_t c = 0; c < model.models.size(); ++c) {
      add_model(c, model.models[c].parts, model.models[c].share);
    }
  }

  void roll_out(double resting, StageArrays& at) const override {
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
      step(at.states.data() + k * size, input, at.states.data() + (k + 1) * size);
    }
  }

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

  void evaluate(StageArrays& at) const override {
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
          Lanes middle = at.inputs[k] * load<Lanes>(middle_input_.at(kLanes * q));
          for (std::size_t i = 0; i < 3; ++i) {
            middle = middle + b[i] * load<Lanes>(middle_base_.at(i * models + kLanes * q));
          }
          for (std::size_t i = 0; i < swing; ++i) {
            middle = middle + z[i] * load<Lanes>(middle_by_place_.at(i * models + kLanes * q));
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

  void change_aims(const double* node_aims, const double* middle_aims, double origin,
                   double per_unit, StageArrays& at) const override {
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

  void carry_slope_back(const PerKind<const double*>& forces, double faint_pull,
                        bool pulled_by_inputs, StageArrays& at, double* slope) const override {
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
      Lanes by_input = broadcast<Lanes>(0.0);
      Lanes by_accel = broadcast<Lanes>(0.0);
      for (std::size_t v = 0; v < v_count; ++v) {
        by_input = by_input + (jerk(0, v) * g[v] + jerk(1, v) * g[v_count + v]);
        by_accel = by_accel + (accel(0, v) * g[v] + accel(1, v) * g[v_count + v]);
      }
      Lanes of_base[2] = {broadcast<Lanes>(0.0), broadcast<Lanes>(0.0)};
      const double* const pulls = at.middle_pull.data() + k * models;
      for (std::size_t q = 0; q < model_groups(); ++q) {
        const Lanes pull = load<Lanes>(pulls + kLanes * q);
        by_input = by_input + pull * load<Lanes>(middle_input_.at(kLanes * q));
        by_accel = by_accel + pull * load<Lanes>(middle_base_.at(2 * models + kLanes * q));
        for (std::size_t i = 0; i < 2; ++i) {
          of_base[i] = of_base[i] + pull * load<Lanes>(middle_base_.at(i * models + kLanes * q));
        }
      }
      const double down = jerk_weight * at.inputs[k] -
                          (jerk_force != nullptr ? jerk_force[k] : 0.0) + sum(by_input) +
                          (kBaseByJerk[0] * gb[0] + kBaseByJerk[1] * gb[1] + gb[2]);
      at.feedforward[k] = -down * at.inverse_curvature[k];
      at.decrement -= 0.5 * down * at.feedforward[k];
      gb[2] = 0.5 * gb[0] + gb[1] + gb[2] + sum(by_accel);
      gb[1] += gb[0] + sum(of_base[1]);
      gb[0] += sum(of_base[0]);
      const double* const f = at.feedback.data() + k * size;
      for (std::size_t v = 0; v < v_count; ++v) {
        const Lanes y = g[v];
        const Lanes rate = g[v_count + v];
        g[v] = own(0, v) * y + own(2, v) * rate;
        g[v_count + v] = own(1, v) * y + own(3, v) * rate;
      }
      for (std::size_t c = 0; c < models; ++c) {
        for (std::size_t v = 0; v < 2 * v_count; ++v) {
          g[v] = g[v] +
                 pulls[c] * load<Lanes>(middle_by_model_.at(c * 2 * kLanes * v_count + kLanes * v));
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

  void step_forward(StageArrays& at) const override {
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

  void go_forward(const double* first_step, StageArrays& at) const override {
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

  void write_nozzles(double origin, double unit, const StageArrays& at,
                     double* nozzles) const override {
    const std::size_t size = state_size();
    for (std::size_t k = 0; k < at.nodes; ++k) {
      for (std::size_t q = 0; q < model_groups(); ++q) {
        store(broadcast<Lanes>(origin) + unit * nozzle(at.states.data() + k * size, q),
              nozzles + k * model_places() + kLanes * q);
      }
    }
  }

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

  // Four modes' part of A, a and β.
  [[nodiscard]] Lanes own(std::size_t part, std::size_t v) const {
    return load<Lanes>(own_.at(kLanes * (part * groups() + v)));
  }
  [[nodiscard]] Lanes accel(std::size_t part, std::size_t v) const {
    return load<Lanes>(by_accel_.at(kLanes * (part * groups() + v)));
  }
  [[nodiscard]] Lanes jerk(std::size_t part, std::size_t v) const {
    return load<Lanes>(by_jerk_.at(kLanes * (part * groups() + v)));
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
  // By b, ḃ and b̈, see stage_form.hpp.
  [[nodiscard]] static std::array<double, 3> prescribed_feedback(const StageArrays& at,
                                                                 std::size_t k) {
    if (k + 2 == at.nodes) {
      return {0.0, -2.0, -2.0};
    }
    // (1, 2/3, 1/6) Φ
    return {-1.0 / kRestingByJerk, -(1.0 + 2.0 / 3.0) / kRestingByJerk,
            -(0.5 + 2.0 / 3.0 + 1.0 / 6.0) / kRestingByJerk};
  }

  void add_model(std::size_t c, const std::vector<SharedModes::Part>& parts, double share) {
    const std::size_t k = mode_places();
    const std::size_t models = model_places();
    const std::size_t swing = 2 * k;
    std::vector<double> place(swing + 3);
    std::vector<double> rate(swing + 3);
    place[swing] = 1.0;
    rate[swing + 1] = 1.0;
    for (const auto& [i, gain] : parts) {
      for (const auto& [other, other_gain] : parts) {
        in_one_model_[i / kLanes * groups() + other / kLanes] = 1;
      }
      place[i] += gain;
      rate[k + i] += gain;
      by_model_[c * k + i] += gain;
      by_mode_[i * models + c] += gain;
    }
    // p = (p₁ + p₂)/2 + (ṗ₁ − ṗ₂)/8.
    std::vector<double> middle(swing + 3);
    for (std::size_t i = 0; i < middle.size(); ++i) {
      middle[i] = 0.5 * place[i] - 0.125 * rate[i];
    }
    const double input = by_input(middle.data());
    transpose_step(middle.data());
    for (std::size_t i = 0; i < middle.size(); ++i) {
      middle[i] += 0.5 * place[i] + 0.125 * rate[i];
    }
    share_[c] = share;
    is_model_[c] = 1.0;
    middle_input_[c] = input;
    for (std::size_t i = 0; i < swing; ++i) {
      middle_by_model_[c * swing + i] = middle[i];
      middle_by_place_[i * models + c] = middle[i];
      middle_cross_[i] += share * input * middle[i];
      for (std::size_t j = 0; j < swing; ++j) {
        middle_square_[i * swing + j] += share * middle[i] * middle[j];
      }
    }
    for (std::size_t i = 0; i < k; ++i) {
      node_cross_[i] += share * place[i];
      for (std::size_t j = 0; j < k; ++j) {
        node_square_[i * k + j] += share * place[i] * place[j];
      }
    }
    node_base_ += share;
    for (std::size_t i = 0; i < 3; ++i) {
      const double of_base = middle[swing + i];
      middle_base_[i * models + c] = of_base;
      middle_base_cross_[i] += share * input * of_base;
      for (std::size_t j = 0; j < swing; ++j) {
        middle_by_base_[i * swing + j] += share * of_base * middle[j];
      }
      for (std::size_t j = 0; j < 3; ++j) {
        middle_base_square_[i][j] += share * of_base * middle[swing + j];
      }
    }
    middle_curvature_ += share * input * input;
  }

  // Bᵀ v
  [[nodiscard]] double by_input(const double* v) const {
    const std::size_t k = mode_places();
    const double* const b = v + 2 * k;
    double result = kBaseByJerk[0] * b[0] + kBaseByJerk[1] * b[1] + kBaseByJerk[2] * b[2];
    for (std::size_t i = 0; i < k; ++i) {
      result += by_jerk_[i] * v[i] + by_jerk_[k + i] * v[k + i];
    }
    return result;
  }

  // v ← Φᵀ v
  void transpose_step(double* v) const {
    const std::size_t k = mode_places();
    double* const b = v + 2 * k;
    double of_accel = 0.5 * b[0] + b[1] + b[2];
    for (std::size_t i = 0; i < k; ++i) {
      const double y = v[i];
      const double rate = v[k + i];
      of_accel += by_accel_[i] * y + by_accel_[k + i] * rate;
      v[i] = own_[i] * y + own_[2 * k + i] * rate;
      v[k + i] = own_[k + i] * y + own_[3 * k + i] * rate;
    }
    b[1] += b[0];
    b[2] = of_accel;
  }

  // z_{k+1} from z_k and j_k.
  void step(const double* z, double input, double* next) const {
    const std::size_t g = groups();
    const double* const b = z + base_place();
    double* const to = next + base_place();
    for (std::size_t v = 0; v < g; ++v) {
      const Lanes y = load<Lanes>(z + kLanes * v);
      const Lanes rate = load<Lanes>(z + kLanes * (g + v));
      store(own(0, v) * y + own(1, v) * rate + (b[2] * accel(0, v) + input * jerk(0, v)),
            next + kLanes * v);
      store(own(2, v) * y + own(3, v) * rate + (b[2] * accel(1, v) + input * jerk(1, v)),
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

  // stage_factor_lanes.hpp has these.
  void begin_at_end(const PerKind<const double*>& weights, const StageArrays& at);
  [[nodiscard]] std::size_t kept_size() const {
    return 4 * mode_places() * mode_places() + 3 * 2 * mode_places() + 9;
  }
  void keep(std::size_t k);
  void take_kept(std::size_t k);
  bool carry_cost_back(std::size_t k, const PerKind<const double*>& weights, StageArrays& at);
  void carry_swing_back(const double* f, const LaneRow<Lanes, 2 * V>& c, double middle,
                        double node);
  template <bool kCosts>
  void carry_block_back(std::size_t a, std::size_t v, const double* f,
                        const LaneRow<Lanes, 2 * V>& c, double middle, double node);
  void carry_cross_back(const LaneRow<Lanes, 2 * V>& u, const LaneRow<Lanes, 2 * V>& c,
                        const double* fb, double middle, double node);

  // Steps from node to node. take(k, swing, base) and take_input(k, input) get them.
  template <class Take, class TakeInput>
  void forward(const double* first, const StageArrays& at, const Take& take,
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
        y[v] = own(0, v) * place + own(1, v) * rate + (b[2] * accel(0, v) + input * jerk(0, v));
        y[g + v] = own(2, v) * place + own(3, v) * rate + (b[2] * accel(1, v) + input * jerk(1, v));
      }
      b[0] += b[1] + 0.5 * b[2] + kBaseByJerk[0] * input;
      b[1] += b[2] + kBaseByJerk[1] * input;
      b[2] += input;
    }
  }

  static constexpr std::size_t kK = kLanes * V;
  static constexpr std::size_t kM = kLanes * W;

  template <std::size_t N>
  using Numbers = KernelNumbers<Lanes, N>;

  std::size_t groups_ = 0;
  std::size_t model_groups_ = 0;
  double jerk_weight_ = 0.0;
  Numbers<4 * kK> own_;       // A, by parts
  Numbers<2 * kK> by_accel_;  // a
  Numbers<2 * kK> by_jerk_;   // β
  Numbers<kM> share_;         // α
  Numbers<kM> is_model_;      // 1, and 0 where a lane is too many
  // A mode's gain in a model, by models and by modes.
  Numbers<kM * kK> by_model_;
  Numbers<kM * kK> by_mode_;
  // m, by models and by places of the swing; of the base; and μ.
  Numbers<2 * kM * kK> middle_by_model_;
  Numbers<2 * kM * kK> middle_by_place_;
  Numbers<3 * kM> middle_base_;
  Numbers<kM> middle_input_;
  // Σ α of the squares of p, whose swing hangs on places alone, and Σ α of those in the middle.
  Numbers<kK * kK> node_square_;
  Numbers<kK> node_cross_;
  double node_base_ = 0.0;
  Numbers<4 * kK * kK> middle_square_;
  std::vector<char> in_one_model_;  // whether some model has modes of both groups
  Numbers<6 * kK> middle_by_base_;
  std::array<std::array<double, 3>, 3> middle_base_square_{};
  // Σ α μ m and Σ α μ².
  Numbers<2 * kK> middle_cross_;
  std::array<double, 3> middle_base_cross_{};
  double middle_curvature_ = 0.0;
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
