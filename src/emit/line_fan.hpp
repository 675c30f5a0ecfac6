// All lines that begin with one of a few states, by their duration.
//
// Take a line at speed v. At j candidates after its begin, e is what it would be if the machine
// stayed where it is, plus v times the answer to a ramp. So J is a quadratic of v, and its
// coefficients are sums over j. The sums of one duration continue those of a shorter one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "line_cost.hpp"

namespace unflex::emit {

// Number of states that are handled at once.
inline constexpr std::size_t kLanes = 4;
using Lanes = Eigen::Array<double, kLanes, 1>;

// The cost of a line and all that comes after it, for each state:
// least + ½ (v − best)ᵀ S (v − best).
struct FanChoice {
  Lanes least = Lanes::Zero();
  Lanes best_x_mm_s = Lanes::Zero();
  Lanes best_y_mm_s = Lanes::Zero();
  double xx = 0.0;  // S
  double xy = 0.0;
  double yy = 0.0;

  [[nodiscard]] Eigen::Vector2d best_mm_s(std::size_t lane) const {
    const auto i = static_cast<Eigen::Index>(lane);
    return {best_x_mm_s[i], best_y_mm_s[i]};
  }
  [[nodiscard]] double at(std::size_t lane, const Eigen::Vector2d& v) const {
    const Eigen::Vector2d off = v - best_mm_s(lane);
    return least[static_cast<Eigen::Index>(lane)] + 0.5 * xx * off[0] * off[0] +
           xy * off[0] * off[1] + 0.5 * yy * off[1] * off[1];
  }
};

template <int kModes>
class LineFan {
 public:
  explicit LineFan(const LineCosts<kModes>& costs) : costs_(&costs) {}

  // Begins lines at τ_k, one from each of these z, no more than kLanes.
  void begin(std::size_t k, std::span<const ZVector<kModes>> states);
  // Extends the lines to m candidates. m must not decrease from call to call.
  void reach(std::size_t m);

  // For the lines reached: the duration, the cost with what follows, J alone, and z at the end.
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] FanChoice choice(const Quadratic<kModes>& to_go) const;
  [[nodiscard]] double cost(std::size_t lane, const Eigen::Vector2d& v) const;
  [[nodiscard]] ZVector<kModes> after(std::size_t lane, const Eigen::Vector2d& v) const;

 private:
  // The components of the modes' states, for each lane.
  using ModeLanes = std::array<Lanes, 2 * kModes>;
  static ModeLanes zeros() {
    ModeLanes result;
    result.fill(Lanes::Zero());
    return result;
  }
  // One axis: its state at the begin, and sums over the candidates so far.
  struct Axis {
    const NozzleAnswers<kModes>* answers = nullptr;
    Lanes place = Lanes::Zero();  // o
    ModeLanes behind = zeros();   // each mode's state minus that at rest where the line begins
    Lanes pull = Lanes::Zero();   // Σ ramp (W e)
    double ramps = 0.0;           // Σ W ramp²
    double base = 0.0;            // Σ (b_{k+j} − b_k)
    double time_base = 0.0;       // Σ j dt (b_{k+j} − b_k)
    // For the lines reached:
    Lanes slope = Lanes::Zero();  // ∂J/∂v at v = 0
    ModeLanes error = zeros();    // e and o at the end for v = 0
    Lanes end = Lanes::Zero();
    double stiffness = 0.0;                                  // ∂²J/∂v²
    ModesVector<kModes> ramp = ModesVector<kModes>::Zero();  // what e at the end gains with v
  };
  void finish(Axis& axis, Eigen::Index index) const;

  const LineCosts<kModes>* costs_;
  std::size_t k_ = 0;
  std::size_t m_ = 0;
  Axis x_;
  Axis y_;
  Lanes square_ = Lanes::Zero();  // Σ eᵀWe for v = 0
  double ramps_xy_ = 0.0;
  double base_square_ = 0.0;    // Σ |b_{k+j} − b_k|²
  double times_s_ = 0.0;        // Σ j dt
  double times_squared_ = 0.0;  // Σ (j dt)²
  // For the lines reached:
  double duration_s_ = 0.0;
  Lanes held_ = Lanes::Zero();  // J for v = 0
  double stiffness_xy_ = 0.0;
};

extern template class LineFan<1>;
extern template class LineFan<2>;
extern template class LineFan<3>;
extern template class LineFan<4>;
extern template class LineFan<6>;

}  // namespace unflex::emit
