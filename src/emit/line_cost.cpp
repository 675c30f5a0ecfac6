#include "line_cost.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::FlexibleAxis;

// Candidate times per node of the base.
constexpr std::size_t kPerNode = 2;
// During a line the error is sampled at no more than this many moments.
constexpr std::size_t kLooks = 16;
// The frequencies of the two nozzles that follow the lines are off by this share of
// LineRules::freq_error. A larger share makes the error larger in the middle of the band and
// smaller at its ends.
constexpr double kOfFreqError = 0.7;

std::vector<FlexibleAxis> models_for(const FlexibleAxis& axis, double freq_error) {
  if (freq_error <= 0.0) {
    return {axis};
  }
  const double off = kOfFreqError * freq_error;
  return {axis.detuned(1.0 - off), axis.detuned(1.0 + off)};
}

// modes_each modes of each axis, one axis after the other.
template <int kModes>
NozzleAnswers<kModes> nozzle_answers(const std::vector<FlexibleAxis>& axes, std::size_t modes_each,
                                     double dt, std::size_t count) {
  NozzleAnswers<kModes> result;
  result.free.resize(count + 1);
  result.step.resize(count + 1);
  result.ramp.resize(count + 1);
  for (std::size_t mode = 0; mode < kModes; ++mode) {
    const StepMatrix step(axes[mode / modes_each], mode % modes_each, dt);
    const auto at = static_cast<Eigen::Index>(2 * mode);
    result.free[0].template middleCols<2>(at).setIdentity();
    result.step[0].template segment<2>(at).setZero();
    result.ramp[0].template segment<2>(at).setZero();
    for (std::size_t j = 0; j < count; ++j) {
      result.free[j + 1].template middleCols<2>(at) =
          step.free() * result.free[j].template middleCols<2>(at);
      result.step[j + 1].template segment<2>(at) =
          step.free() * result.step[j].template segment<2>(at) + step.base(1.0, 0.0);
      result.ramp[j + 1].template segment<2>(at) =
          step.free() * result.ramp[j].template segment<2>(at) +
          step.base(static_cast<double>(j) * dt, 1.0);
    }
  }
  return result;
}

// Where (e, o, u) of an axis stand in w.
template <int kModes>
constexpr std::array<int, kOfAxis<kModes> + 1> places(int axis) {
  std::array<int, kOfAxis<kModes> + 1> result{};
  for (int i = 0; i < kOfAxis<kModes>; ++i) {
    result[static_cast<std::size_t>(i)] = axis * kOfAxis<kModes> + i;
  }
  result[kOfAxis<kModes>] = kOfZ<kModes> + axis;
  return result;
}

}  // namespace

template <int kModes>
WholeCost<kModes> whole_cost(const LineCost<kModes>& line, const Quadratic<kModes>& to_go) {
  // lazyProduct: Eigen's blocked product does not pay at this size.
  const typename LineCost<kModes>::Move moved = to_go.matrix.lazyProduct(line.move);
  const ZVector<kModes> pull = to_go.matrix.lazyProduct(line.shift) + to_go.slope;
  return {line.matrix + line.move.transpose().lazyProduct(moved),
          line.slope + line.move.transpose().lazyProduct(pull),
          line.constant + to_go.at(line.shift)};
}

template <int kModes>
LineChoice<kModes> best_end(const LineCost<kModes>& line, const Quadratic<kModes>& to_go) {
  constexpr int kZ = kOfZ<kModes>;
  const auto [all, slope, constant] = whole_cost(line, to_go);
  LineChoice<kModes> choice;
  choice.stiffness = all.template bottomRightCorner<2, 2>();
  const Eigen::Matrix2d inverse = choice.stiffness.inverse();
  choice.feedback = -inverse * all.template bottomLeftCorner<2, kZ>();
  choice.feed_forward = -inverse * slope.template tail<2>();
  choice.value.matrix =
      all.template topLeftCorner<kZ, kZ>() + all.template topRightCorner<kZ, 2>() * choice.feedback;
  choice.value.slope =
      slope.template head<kZ>() + all.template topRightCorner<kZ, 2>() * choice.feed_forward;
  choice.value.constant = line.constant + to_go.at(line.shift) +
                          0.5 * slope.template tail<2>().dot(choice.feed_forward);
  return choice;
}

template <int kModes>
Quadratic<kModes> ending_on_base(const LineCost<kModes>& line, const Quadratic<kModes>& to_go) {
  constexpr int kZ = kOfZ<kModes>;
  const auto [all, slope, constant] = whole_cost(line, to_go);
  return {all.template topLeftCorner<kZ, kZ>(), slope.template head<kZ>(), constant};
}

Candidates::Candidates(const BaseTrajectory& base, const std::function<ErrorWeight(double)>& weight)
    : dt_s_(base.period_s / kPerNode) {
  const std::size_t count = (base.nodes() - 1) * kPerNode + 1;
  base_.reserve(count);
  weights_.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double t = time_s(k);
    base_.push_back(vector(base.position_mm(t)));
    weights_.push_back(weight(t));
  }
}

std::size_t Candidates::candidates(double duration_s) const {
  return static_cast<std::size_t>(std::ceil(duration_s / dt_s_ - 1e-9));
}

template <int kModes>
LineCosts<kModes>::LineCosts(const BaseTrajectory& base,
                             const std::function<ErrorWeight(double)>& weight,
                             const LineRules& rules)
    : Candidates(base, weight), modes_each_(kModes / nozzles_for(rules)) {
  const auto longest = static_cast<std::size_t>(std::ceil(rules.max_line_s / dt_s())) + 1;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    Axis& all = axes_[axis];
    all.models = models_for(rules.nozzle[axis], rules.freq_error);
    std::vector<Followed> follow;
    for (const FlexibleAxis& model : all.models) {
      follow.emplace_back(base, axis, model);
    }
    all.at.reserve(size());
    for (std::size_t k = 0; k < size(); ++k) {
      all.at.push_back(
          beside_each_other([&](std::size_t nozzle) { return follow[nozzle].at(time_s(k)); }));
    }
    all.riding_at_1_mm =
        beside_each_other([&](std::size_t nozzle) { return all.models[nozzle].riding(1.0, 0.0); });
    all.riding_at_1_mm_s =
        beside_each_other([&](std::size_t nozzle) { return all.models[nozzle].riding(0.0, 1.0); });
    all.answers = nozzle_answers<kModes>(all.models, modes_each_, dt_s(), longest);
  }
  shapes_.emplace_back();
  for (std::size_t m = 1; m <= longest; ++m) {
    shapes_.push_back(shape(m));
  }
  same_weight_until_.assign(size(), size() - 1);
  for (std::size_t k = size() - 1; k-- > 0;) {
    same_weight_until_[k] = this->weight(k) == this->weight(k + 1) ? same_weight_until_[k + 1] : k;
  }
}

template <int kModes>
template <class StateOfNozzle>
ModesVector<kModes> LineCosts<kModes>::beside_each_other(StateOfNozzle state_of_nozzle) const {
  ModesVector<kModes> result;
  for (std::size_t nozzle = 0; nozzle < nozzles(); ++nozzle) {
    const dynamics::NozzleState state = state_of_nozzle(nozzle);
    for (std::size_t mode = 0; mode < modes_each_; ++mode) {
      const auto at = static_cast<Eigen::Index>(2 * (nozzle * modes_each_ + mode));
      result.template segment<2>(at) << state.parts[mode].position, state.parts[mode].velocity;
    }
  }
  return result;
}

template <int kModes>
ModesVector<kModes> LineCosts<kModes>::riding(std::size_t axis, double position_mm,
                                              double velocity_mm_s) const {
  return position_mm * axes_[axis].riding_at_1_mm + velocity_mm_s * axes_[axis].riding_at_1_mm_s;
}

template <int kModes>
typename LineCosts<kModes>::Shape LineCosts<kModes>::shape(std::size_t m) const {
  const double duration = static_cast<double>(m) * dt_s();
  Shape result;
  const std::size_t looks = std::min(m, kLooks);
  result.between_s = duration / static_cast<double>(looks);
  const double share_s = result.between_s / static_cast<double>(nozzles());
  for (std::size_t look = 1; look <= looks; ++look) {
    const std::size_t j = look * m / looks;
    const auto row = [&](const NozzleAnswers<kModes>& answer, std::size_t nozzle) {
      Row result_row = Row::Zero();
      for (auto [i, end] = entries(nozzle); i < end; ++i) {
        result_row[i] = answer.free[j](0, i);
      }
      const double ramp = place(nozzle, answer.ramp[j]) / duration;
      result_row[2 * kModes] = place(nozzle, answer.step[j]) - ramp;
      result_row[2 * kModes + 1] = ramp;
      return result_row;
    };
    const double s = static_cast<double>(j) / static_cast<double>(m);
    for (std::size_t nozzle = 0; nozzle < nozzles(); ++nozzle) {
      const Row x = row(answers(0), nozzle);
      const Row y = row(answers(1), nozzle);
      result.looks.push_back({j, s, nozzle, x, y});
      result.xx += share_s * x.transpose() * x;
      result.xy += share_s * x.transpose() * y;
      result.yy += share_s * y.transpose() * y;
    }
    Row base = Row::Zero();
    base[2 * kModes] = 1.0 - s;
    base[2 * kModes + 1] = s;
    result.base += kBaseWeight * result.between_s * base.transpose() * base;
  }
  return result;
}

template <int kModes>
typename LineCosts<kModes>::Chord LineCosts<kModes>::chord(std::size_t k, std::size_t m) const {
  Chord chord;
  chord.duration_s = static_cast<double>(m) * dt_s();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    chord.begin[axis] = nozzle(axis, k) - riding(axis, base_mm(k)[a]);
    chord.speed_mm_s[axis] = (base_mm(k + m)[a] - base_mm(k)[a]) / chord.duration_s;
  }
  return chord;
}

template <int kModes>
inline typename LineCosts<kModes>::Off LineCosts<kModes>::off_at(const Look& look,
                                                                 const Chord& chord,
                                                                 std::size_t k) const {
  const std::size_t j = look.j;
  Off off;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const NozzleAnswers<kModes>& answer = answers(axis);
    auto [i, end] = entries(look.nozzle);
    double swing = answer.free[j](0, i) * chord.begin[axis][i];
    for (++i; i < end; ++i) {
      swing += answer.free[j](0, i) * chord.begin[axis][i];
    }
    off.nozzle_mm[axis] = swing + place(look.nozzle, answer.ramp[j]) * chord.speed_mm_s[axis] -
                          (place(look.nozzle, nozzle(axis, k + j)) - base_mm(k)[a]);
    off.base_mm[axis] =
        chord.speed_mm_s[axis] * look.s * chord.duration_s - (base_mm(k + j)[a] - base_mm(k)[a]);
  }
  return off;
}

template <int kModes>
inline void LineCosts<kModes>::add_off(const Look& look, const Off& off, const ErrorWeight& w,
                                       double share_s, RowSums& sums) {
  const double base_weight = kBaseWeight * share_s;
  const double to_x = share_s * (w.xx * off.nozzle_mm[0] + w.xy * off.nozzle_mm[1]);
  const double to_y = share_s * (w.xy * off.nozzle_mm[0] + w.yy * off.nozzle_mm[1]);
  sums.slope_x += to_x * look.x;
  sums.slope_y += to_y * look.y;
  Row base = Row::Zero();
  base[2 * kModes] = 1.0 - look.s;
  base[2 * kModes + 1] = look.s;
  sums.slope_x += base_weight * off.base_mm[0] * base;
  sums.slope_y += base_weight * off.base_mm[1] * base;
  sums.constant +=
      0.5 * (to_x * off.nozzle_mm[0] + to_y * off.nozzle_mm[1]) +
      0.5 * base_weight * (off.base_mm[0] * off.base_mm[0] + off.base_mm[1] * off.base_mm[1]);
}

template <int kModes>
void LineCosts<kModes>::add_looks(std::size_t k, std::size_t m, const Chord& chord,
                                  RowSums& sums) const {
  const Shape& shape = shapes_[m];
  const bool same_weight = same_weight_until_[k + 1] >= k + m;
  const ErrorWeight& only = weight(k + 1);
  sums.xx = shape.base;
  sums.yy = shape.base;
  if (same_weight) {
    sums.xx += only.xx * shape.xx;
    sums.xy = only.xy * shape.xy;
    sums.yy += only.yy * shape.yy;
  }
  const double share_s = shape.between_s / static_cast<double>(nozzles());
  for (const Look& look : shape.looks) {
    const ErrorWeight& w = weight(k + look.j);
    if (!same_weight) {
      sums.xx += share_s * w.xx * look.x.transpose() * look.x;
      sums.xy += share_s * w.xy * look.x.transpose() * look.y;
      sums.yy += share_s * w.yy * look.y.transpose() * look.y;
    }
    add_off(look, off_at(look, chord, k), w, share_s, sums);
  }
}

template <int kModes>
void LineCosts<kModes>::write_cost(const RowSums& sums, LineCost<kModes>& result) {
  static constexpr auto kPlacesX = places<kModes>(0);
  static constexpr auto kPlacesY = places<kModes>(1);
  for (int i = 0; i < kRow; ++i) {
    const int xi = kPlacesX[static_cast<std::size_t>(i)];
    const int yi = kPlacesY[static_cast<std::size_t>(i)];
    for (int j = 0; j < kRow; ++j) {
      const int xj = kPlacesX[static_cast<std::size_t>(j)];
      const int yj = kPlacesY[static_cast<std::size_t>(j)];
      result.matrix(xi, xj) = sums.xx(i, j);
      result.matrix(xi, yj) = sums.xy(i, j);
      result.matrix(yj, xi) = sums.xy(i, j);
      result.matrix(yi, yj) = sums.yy(i, j);
    }
    result.slope[xi] = sums.slope_x[i];
    result.slope[yi] = sums.slope_y[i];
  }
  result.constant = sums.constant;
}

template <int kModes>
void LineCosts<kModes>::write_move(std::size_t k, std::size_t m, const Chord& chord,
                                   LineCost<kModes>& result) const {
  constexpr int kStates = 2 * kModes;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const NozzleAnswers<kModes>& answer = answers(axis);
    const Eigen::Index first = kOfAxis<kModes> * a;
    const Eigen::Index u = kOfZ<kModes> + a;
    for (Eigen::Index i = 0; i < kStates; i += 2) {
      result.move.template block<2, 2>(first + i, first + i) =
          answer.free[m].template middleCols<2>(i);
    }
    result.move.template block<kStates, 1>(first, first + kStates) =
        answer.step[m] - answer.ramp[m] / chord.duration_s;
    result.move.template block<kStates, 1>(first, u) = answer.ramp[m] / chord.duration_s;
    result.move(first + kStates, u) = 1.0;
    result.shift.template segment<kStates>(first) =
        answer.after(m, chord.begin[axis]) + answer.ramp[m] * chord.speed_mm_s[axis] -
        (nozzle(axis, k + m) - riding(axis, base_mm(k)[a]));
  }
}

template <int kModes>
LineCost<kModes> LineCosts<kModes>::line(std::size_t k, std::size_t m) const {
  const Chord chord = this->chord(k, m);
  RowSums sums;
  add_looks(k, m, chord, sums);
  LineCost<kModes> result;
  write_cost(sums, result);
  write_move(k, m, chord, result);
  return result;
}

// The first step is late, and the others have caught up at the line's end. So the place lags by a
// triangle, δ high, over the line's time T. To a mode this is nearly an impulse of g ω² δ T / 2 at
// the triangle's centroid.
template <int kModes>
ZVector<kModes> LineCosts<kModes>::lead_kick(double line_s, double steps,
                                             const Eigen::Vector2d& speed_mm_s,
                                             double before_mm_s) const {
  ZVector<kModes> kick = ZVector<kModes>::Zero();
  const double v = speed_mm_s.norm();
  if (v <= before_mm_s) {
    return kick;
  }
  const double step_s = line_s / steps;
  const double first_s = before_mm_s > 0.0 ? std::min(step_s * v / before_mm_s, line_s) : line_s;
  const Eigen::Vector2d area = 0.5 * (first_s - step_s) * line_s * speed_mm_s;
  const double after_s = line_s - (first_s + line_s) / 3.0;
  const auto j = static_cast<std::size_t>(after_s / dt_s() + 0.5);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    for (std::size_t nozzle = 0; nozzle < nozzles(); ++nozzle) {
      auto column = static_cast<Eigen::Index>(entries(nozzle).first);
      for (const dynamics::Mode& mode : axes_[axis].models[nozzle].modes()) {
        kick.template segment<2>(kOfAxis<kModes> * a + column) =
            -mode.gain * mode.stiffness_per_s2() * area[a] * answers(axis).free[j].col(column + 1);
        column += 2;
      }
    }
  }
  return kick;
}

template <int kModes>
Quadratic<kModes> LineCosts<kModes>::ring_down() const {
  const ErrorWeight& w = weight(size() - 1);
  Quadratic<kModes> result;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double share = (axis == 0 ? w.xx : w.yy) / static_cast<double>(nozzles());
    for (std::size_t nozzle = 0; nozzle < nozzles(); ++nozzle) {
      const auto size = static_cast<Eigen::Index>(2 * modes_each_);
      const Eigen::Index at = kOfAxis<kModes> * static_cast<Eigen::Index>(axis) +
                              static_cast<Eigen::Index>(entries(nozzle).first);
      result.matrix.block(at, at, size, size) =
          share * ring_down_square<dynamics::kMostModes>(axes_[axis].models[nozzle])
                      .topLeftCorner(size, size);
    }
  }
  return result;
}

#define UNFLEX_FOR_MODES(kModes)                                                                \
  template WholeCost<kModes> whole_cost(const LineCost<kModes>&, const Quadratic<kModes>&);     \
  template LineChoice<kModes> best_end(const LineCost<kModes>&, const Quadratic<kModes>&);      \
  template Quadratic<kModes> ending_on_base(const LineCost<kModes>&, const Quadratic<kModes>&); \
  template class LineCosts<kModes>;

UNFLEX_FOR_MODES(1)
UNFLEX_FOR_MODES(2)
UNFLEX_FOR_MODES(3)
UNFLEX_FOR_MODES(4)
UNFLEX_FOR_MODES(6)

}  // namespace unflex::emit
