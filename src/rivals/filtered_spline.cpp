#include "unflex/rivals/filtered_spline.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "unflex/core/math.hpp"

namespace unflex::rivals {
namespace {

constexpr int kDegree = 5;
constexpr int kSupport = kDegree + 1;  // knots spanned by one basis function
constexpr int kSamples = 5;            // per knot
constexpr int kParts = 16;             // parabolas per knot that stand for the quintic
constexpr std::size_t kWindow = 60;
constexpr std::size_t kKept = 30;
// A basis function's response is cut off when only this share of it is left.
constexpr double kForgotten = 1e-8;

// Σ_i (−1)^i C(n+1, i) (u − i)₊^m / m!: the cardinal spline for m = n, its derivatives for m < n.
double cardinal(double u, int m) {
  constexpr std::array<double, kSupport + 1> kBinomial = {1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0};
  if (u <= 0.0 || u >= kSupport) {
    return 0.0;
  }
  double sum = 0.0;
  for (int i = 0; i <= static_cast<int>(u); ++i) {
    double term = kBinomial[static_cast<std::size_t>(i)];
    for (int power = 1; power <= m; ++power) {
      term *= (u - i) / power;
    }
    sum += term;
  }
  return sum;
}

// N, N′ and N″ at every part of a knot. Entry i is for i / kParts knots after the first one.
using BasisTable = std::vector<std::array<double, 3>>;

BasisTable basis_table() {
  BasisTable table;
  for (int i = 0; i <= kSupport * kParts; ++i) {
    const double u = static_cast<double>(i) / kParts;
    table.push_back({cardinal(u, kDegree), cardinal(u, kDegree - 1), cardinal(u, kDegree - 2)});
  }
  return table;
}

void append(dynamics::AxisTrajectory& nodes, const std::array<double, 3>& motion, double knot_s) {
  nodes.position_mm.push_back(motion[0]);
  nodes.velocity_mm_s.push_back(motion[1] / knot_s);
  nodes.accel_mm_s2.push_back(motion[2] / (knot_s * knot_s));
}

AxisPath basis_path(const BasisTable& table, double knot_s) {
  dynamics::AxisTrajectory nodes;
  for (const std::array<double, 3>& motion : table) {
    append(nodes, motion, knot_s);
  }
  return through_nodes(nodes, 0.0, knot_s / kParts, 1);
}

// φ at the samples, as far as it matters, and at most `longest` of them.
std::vector<double> filtered_basis(const BasisTable& table, const dynamics::FlexibleAxis& axis,
                                   double knot_s, std::size_t longest) {
  const double memory_s =
      kSupport * knot_s - math::log(kForgotten) / std::max(axis.decay_per_s(), 1e-9);
  const double samples = std::ceil(kSamples * memory_s / knot_s);
  TimeGrid grid{0.0, knot_s / kSamples, longest};
  if (samples < static_cast<double>(longest)) {
    grid.count = static_cast<std::size_t>(samples);
  }
  std::vector<double> result;
  for (const dynamics::NozzleState& state : nozzle_on(axis, basis_path(table, knot_s), grid)) {
    result.push_back(state.position());
  }
  return result;
}

// Finds the coefficients one after the other, and keeps the rest of the reference for the next
// ones.
class Preview {
 public:
  Preview(const std::vector<double>& basis, std::vector<double> wanted)
      : basis_(&basis), left_(std::move(wanted)) {}

  // Takes a coefficient's response off what is left.
  void settle(std::size_t number, double value) {
    const std::size_t from = number * kSamples;
    for (std::size_t i = 0; i < basis_->size() && from + i < left_.size(); ++i) {
      left_[from + i] -= value * (*basis_)[i];
    }
  }

  // Least squares for `count` coefficients from `number` on over the samples before `end`.
  [[nodiscard]] Eigen::VectorXd solve(std::size_t number, std::size_t count, std::size_t end) {
    const std::size_t from = number * kSamples;
    const std::size_t rows = std::min(end, left_.size()) - from;
    if (rows != static_cast<std::size_t>(matrix_.rows()) ||
        count != static_cast<std::size_t>(matrix_.cols())) {
      matrix_.setZero(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(count));
      for (std::size_t j = 0; j < count; ++j) {
        for (std::size_t i = j * kSamples; i < rows && i - j * kSamples < basis_->size(); ++i) {
          matrix_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
              (*basis_)[i - j * kSamples];
        }
      }
      factors_.compute(matrix_);
    }
    return factors_.solve(
        Eigen::Map<const Eigen::VectorXd>(left_.data() + from, static_cast<Eigen::Index>(rows)));
  }

 private:
  const std::vector<double>* basis_;
  std::vector<double> left_;
  Eigen::MatrixXd matrix_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors_;
};

// The spline b as parabolas between the parts of the knots.
AxisPath spline_path(const BasisTable& table, const std::vector<double>& coefficients, double first,
                     double start_s, double knot_s) {
  dynamics::AxisTrajectory nodes;
  const std::size_t knots = coefficients.size();
  for (std::size_t i = 0; i <= knots * kParts; ++i) {
    std::array<double, 3> motion = {first, 0.0, 0.0};
    const std::size_t last = std::min(i / kParts, knots - 1);
    for (std::size_t j = last >= kDegree ? last - kDegree : 0; j <= last; ++j) {
      const std::array<double, 3>& basis = table[i - j * kParts];
      for (std::size_t d = 0; d < motion.size(); ++d) {
        motion[d] += (coefficients[j] - first) * basis[d];
      }
    }
    append(nodes, motion, knot_s);
  }
  return through_nodes(nodes, start_s, knot_s / kParts, 1);
}

}  // namespace

SolvedPath filtered_spline(const AxisPath& reference, const dynamics::FlexibleAxis& axis,
                           const SplineOptions& options) {
  const double knot_s = options.knot_s;
  const double length_s = options.lead_in_s + end_s(reference) + options.tail_s;
  // The last knot is at the end of the tail.
  const auto knots = static_cast<std::size_t>(std::ceil(length_s / knot_s));
  const std::size_t free = knots > kDegree ? knots - kDegree : 1;
  const double first = reference.front().motion.position;
  const double last = reference.back().motion.position;
  // The coefficients after the free ones stay at the end position. We take as many of them as reach
  // into the samples.
  const std::size_t total = free + kSupport;
  std::vector<double> wanted(total * kSamples);
  PathCursor cursor(reference);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    wanted[i] =
        cursor.at(static_cast<double>(i) * knot_s / kSamples - options.lead_in_s).position - first;
  }
  const BasisTable table = basis_table();
  const std::vector<double> basis = filtered_basis(table, axis, knot_s, wanted.size());
  Preview preview(basis, std::move(wanted));
  for (std::size_t j = free; j < total; ++j) {
    preview.settle(j, last - first);
  }
  std::vector<double> coefficients;
  int windows = 0;
  while (coefficients.size() < free) {
    const std::size_t number = coefficients.size();
    const bool final = free - number <= kWindow;
    const std::size_t count = final ? free - number : kWindow;
    const std::size_t end = final ? total * kSamples : (number + kWindow) * kSamples;
    const Eigen::VectorXd solution = preview.solve(number, count, end);
    ++windows;
    for (std::size_t j = 0; j < (final ? count : kKept); ++j) {
      const double value = solution(static_cast<Eigen::Index>(j));
      preview.settle(number + j, value);
      coefficients.push_back(first + value);
    }
  }
  coefficients.resize(total, last);
  return {spline_path(table, coefficients, first, -options.lead_in_s, knot_s),
          {free, total * kSamples},
          windows};
}

}  // namespace unflex::rivals
