// Notation:
//   T       duration of a line, from a to b
//   d(t)    the line that fits b best over [a, b], by least squares, minus b
//   e(t)    what d moves the nozzle by: ë + 2ζωė + ω²e = 2ζωḋ + ω²d
//
// A fitted line leaves ∫d = ∫∫d = 0 at its end. A line is short against the resonance's period, so
// e = ω²∬d + 2ζω∫d: the error begins and ends with the line, and each line can be judged alone.
// With several modes ω² and 2ζω are sums over them, by their gains.
#include "line_ends.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "unflex/core/math.hpp"
#include "vertices.hpp"

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::FlexibleAxis;

constexpr int kMaxSamples = 128;
// Share of the largest change of speed that the base itself may use. The rest is for the vertices,
// which are not on its curve.
constexpr double kOwnShare = 0.8;

// Share of the largest change of speed that a line may use if it is made longer to end at a node.
constexpr double kShareAtNodes = 0.4;

// e at `steps` + 1 points, equally spaced over the line. steps is no more than kMaxSamples.
std::array<double, kMaxSamples + 1> nozzle_error(const FlexibleAxis& axis,
                                                 const dynamics::AxisTrajectory& of_base,
                                                 const BaseTrajectory& base, double from,
                                                 double duration, int steps) {
  std::array<double, kMaxSamples + 1> d{};
  const auto weight = [&](int i) { return i == 0 || i == steps ? 0.5 : 1.0; };
  const auto s = [&](int i) { return static_cast<double>(i) / steps - 0.5; };
  const double origin = base.at(of_base, from).position_mm;
  double sum = 0.0;
  double moment = 0.0;
  double inertia = 0.0;
  for (int i = 0; i <= steps; ++i) {
    double& value = d[static_cast<std::size_t>(i)];
    value = base.at(of_base, from + (s(i) + 0.5) * duration).position_mm - origin;
    sum += weight(i) * value;
    moment += weight(i) * s(i) * value;
    inertia += weight(i) * s(i) * s(i);
  }
  const double dt = duration / steps;
  const double omega = std::sqrt(std::abs(axis.stiffness_per_s2()));
  const double damping = axis.damping_per_s() / omega;
  double last = 0.0;
  double once = 0.0;   // ∫d
  double twice = 0.0;  // ∬d
  for (int i = 0; i <= steps; ++i) {
    double& value = d[static_cast<std::size_t>(i)];
    const double off = sum / steps + moment / inertia * s(i) - value;
    if (i > 0) {
      const double before = once;
      once += 0.5 * dt * (last + off);
      twice += 0.5 * dt * (before + once);
    }
    last = off;
    value = omega * (omega * twice + damping * once);
  }
  return d;
}

// The largest e of one line, over all axes. Modes that move the nozzle in Z move it in X, too, so
// the axis X stands for Z.
double largest_nozzle_error_mm(const BaseTrajectory& base, double from, double to,
                               const LineRules& rules) {
  const double duration = to - from;
  const int steps =
      std::clamp(static_cast<int>(std::ceil(2.0 * duration / base.period_s)), 6, kMaxSamples);
  const auto errors = map_axes(
      [&](const FlexibleAxis& axis, const dynamics::AxisTrajectory& of_base) {
        return nozzle_error(axis, of_base, base, from, duration, steps);
      },
      rules.nozzle, base);
  const auto in_z = base.above
                        ? nozzle_error(rules.nozzle.x, *base.above, base, from, duration, steps)
                        : std::array<double, kMaxSamples + 1>{};
  double largest2 = 0.0;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(steps); ++i) {
    largest2 = std::max(largest2, squared(XY{errors.x[i], errors.y[i]}) + in_z[i] * in_z[i]);
  }
  return std::sqrt(largest2);
}

// The duration of each line if as many lines as possible share the time evenly.
double even_share_s(double from, double to, const LineRules& rules) {
  constexpr double kRounding = 1e-9;
  return (to - from) / std::max(1.0, std::floor((to - from) / rules.even_line_s() + kRounding));
}

// When the shortest line from `start` ends. It is an even share of the time, so that none of the
// lines after it has to be longer: speed changes most between long lines.
double first_end(double start, double to, const LineRules& rules) {
  return start + std::max(even_share_s(start, to, rules), rules.min_line_s);
}

double next_node(double t, double period_s) {
  constexpr double kRounding = 1e-6;
  return std::ceil(t / period_s - kRounding) * period_s;
}

// The largest change of a motor's speed between two moments line_s apart, the later of which lies
// in [from, to]. Where lines of that length join, motors' speeds change by no more than this.
double change_over(const BaseTrajectory& base, double from, double to, double line_s,
                   const Motors& motors) {
  double most = 0.0;
  for (double t = std::max(from, line_s); t < to + base.period_s; t += base.period_s) {
    const auto speed_mm_s = [&](double at) {
      return base.velocity_mm_s(std::min(at, base.duration_s()));
    };
    most = std::max(most, motors.largest_of_xy(speed_mm_s(t) - speed_mm_s(t - line_s)));
  }
  return most;
}

// Tells whether a line would be good.
class Candidate {
 public:
  Candidate(const BaseTrajectory& base, const LineRules& rules) : base_(&base), rules_(&rules) {}

  // Whether the line moves the nozzle little, and speed changes little at both its ends: from the
  // line before, which began at `before`, and to the shortest line that may come behind.
  [[nodiscard]] bool good(double before, double from, double to) const {
    return joins_within(kOwnShare, before, from, to) &&
           largest_nozzle_error_mm(*base_, from, to, *rules_) <= rules_->tolerance_mm;
  }
  // Whether speed changes by no more than this share of what it may at both ends of the line.
  [[nodiscard]] bool joins_within(double share, double before, double from, double to) const {
    const double after = to + rules_->min_line_s;
    return std::max(change(before, from, to), change(from, to, after)) <=
           share * rules_->max_speed_step_mm_s;
  }

 private:
  // The largest change of a motor's speed where lines from a to b and from b to c join. A line
  // without time stands for rest.
  [[nodiscard]] double change(double a, double b, double c) const {
    const auto speed_mm_s = [&](double from, double to) {
      return from < to ? (base_->position_mm(to) - base_->position_mm(from)) / (to - from) : XY{};
    };
    return rules_->motors.largest_of_xy(speed_mm_s(b, c) - speed_mm_s(a, b));
  }

  const BaseTrajectory* base_;
  const LineRules* rules_;
};

// Halves the lines that `which` names by the places of their ends in `times`. A line stays whole if
// its halves would be too short. at_nodes: it is cut at the node next to its middle, unless a part
// would be too short. Returns whether any line was halved.
template <typename Which>
bool halve(const BaseTrajectory& base, const LineRules& rules, bool at_nodes,
           std::vector<double>& times, Which which) {
  std::vector<double> result = {times.front()};
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double from = times[i - 1];
    const auto may_be = [&](double middle) {
      return long_enough(base, from, middle, rules) && long_enough(base, middle, times[i], rules);
    };
    if (which(i)) {
      const double half = 0.5 * (from + times[i]);
      const double node = std::round(half / base.period_s) * base.period_s;
      const double middle = at_nodes && may_be(node) ? node : half;
      if (may_be(middle)) {
        result.push_back(middle);
      }
    }
    result.push_back(times[i]);
  }
  const bool halved = result.size() > times.size();
  times.swap(result);
  return halved;
}

}  // namespace

bool long_enough(const BaseTrajectory& base, double from, double to, const LineRules& rules) {
  if (to - from < rules.even_line_s() - 1e-12) {
    return false;
  }
  if (rules.min_line_mm <= 0.0) {
    return true;
  }
  return largest_part(base.position_mm(to) - base.position_mm(from)) >= rules.min_line_mm;
}

bool cuts_well(const BaseTrajectory& base, double from, double to, const LineRules& rules) {
  // If this many lines share the time, each is hardly longer than the shortest.
  constexpr double kMany = 20.0;
  if (to - from > kMany * rules.even_line_s()) {
    return true;
  }
  const double most = kOfSpeedStep * rules.max_speed_step_mm_s;
  // If even the shortest lines exceed the limit, there is nothing to gain.
  return change_over(base, from, to, even_share_s(from, to, rules), rules.motors) <= most ||
         change_over(base, from, to, rules.even_line_s(), rules.motors) > most;
}

void append_line_ends(const BaseTrajectory& base, double from, double to, const LineRules& rules,
                      std::vector<double>& times) {
  const double h = base.period_s;
  const Candidate line(base, rules);
  double start = from;
  while (true) {
    const double before = times.size() > 1 ? times[times.size() - 2] : start;
    if (to - start <= rules.max_line_s && line.good(before, start, to)) {
      break;
    }
    // The rest must be long enough for a line too. We take the shortest line in any case, and a
    // longer one as long as it is good.
    // The shortest line ends at a node, unless speed would change too much then. Many lines then
    // have one length and share results that are costly to compute (vertices.cpp).
    double end = 0.0;
    const double shortest = first_end(start, to, rules);
    const double at_node = next_node(shortest, h);
    const bool may_be = line.joins_within(kShareAtNodes, before, start, at_node) &&
                        cuts_well(base, at_node, to, rules);
    for (double t = may_be ? at_node : shortest; t < to; t += h) {
      if (long_enough(base, start, t, rules) && long_enough(base, t, to, rules)) {
        end = t;
        break;
      }
    }
    if (end == 0.0) {
      break;
    }
    // The end moves on in doubled steps while the line stays good, then in halved ones.
    bool growing = true;
    for (double step = 1.0; step >= 1.0;) {
      const double t = end + step * h;
      if (t - start <= rules.max_line_s && long_enough(base, start, t, rules) &&
          long_enough(base, t, to, rules) && cuts_well(base, t, to, rules) &&
          line.good(before, start, t)) {
        end = t;
      } else {
        growing = false;
      }
      step = growing ? 2.0 * step : std::floor(0.5 * step);
    }
    times.push_back(end);
    start = end;
  }
  times.push_back(to);
}

bool split_lines(const BaseTrajectory& base, const Axes<AxisVertices>& vertices,
                 const LineRules& rules, std::vector<double>& times) {
  // Errors of lines add up, with any sign, for as long as the nozzle rings.
  constexpr double kAddedUp = 4.0;
  const double most = kAddedUp * rules.tolerance_mm;
  const auto off = [&](std::size_t i) {
    return length(map_axes([&](const AxisVertices& axis) { return axis.nozzle_error_mm[i]; },
                           vertices)) > most;
  };
  return halve(base, rules, true, times,
               [&](std::size_t i) { return off(i) || (i + 1 < times.size() && off(i + 1)); });
}

bool split_quick_joins(const BaseTrajectory& base, const Axes<AxisVertices>& vertices,
                       const LineRules& rules, std::vector<double>& times) {
  const auto change_mm_s = [&](std::size_t i) {
    return map_axes(
        [&](const AxisVertices& axis) {
          const std::vector<double>& at_mm = axis.position_mm;
          const auto speed = [&](std::size_t line) {
            return (at_mm[line] - at_mm[line - 1]) / (times[line] - times[line - 1]);
          };
          return speed(i + 1) - speed(i);
        },
        vertices);
  };
  const auto join = [&](std::size_t i) {
    return i > 0 && i + 1 < times.size() &&
           rules.motors.largest_of_xy(change_mm_s(i)) > rules.max_speed_step_mm_s;
  };
  // Halves of one length change their speed least.
  return halve(base, rules, false, times, [&](std::size_t i) { return join(i) || join(i - 1); });
}

bool split_at_joins(const BaseTrajectory& base, const std::vector<bool>& joins,
                    const LineRules& rules, std::vector<double>& times) {
  return halve(base, rules, true, times,
               [&](std::size_t i) { return joins[i - 1] || (i > 1 && joins[i - 2]); });
}

}  // namespace unflex::emit
