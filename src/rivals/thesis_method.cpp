// The equations form a chain: those of interval k contain the base's position b_k and three
// velocities. So least squares need no large matrix. From the end of the plan on, v_{k+1} is
// eliminated by an orthogonal transformation of the rows that contain it (G. H. Golub & C. F. Van
// Loan, "Matrix Computations", 4th ed., section 5.3). This leaves rows in (b_k, v_{k−1}, v_k)
// alone.
#include "unflex/rivals/thesis_method.hpp"

#include <Eigen/QR>
#include <cmath>
#include <cstddef>
#include <vector>

namespace unflex::rivals {
namespace {

// A linear form in v_{k+1}, b_k, v_{k−1}, v_k and 1.
using Form = Eigen::Matrix<double, 1, 5>;
enum FormPart : int { kNext = 0, kBase, kBefore, kNow, kConstant };

Form unit(FormPart part) { return Form::Unit(part); }

struct Nodes {
  double h;
  std::vector<dynamics::NozzleMotion> nozzle;

  [[nodiscard]] std::size_t count() const { return nozzle.size(); }
};

Nodes sample(const AxisPath& reference, double period_s) {
  Nodes nodes{period_s, {}};
  const auto intervals = static_cast<std::size_t>(std::ceil(end_s(reference) / period_s - 1e-9));
  PathCursor cursor(reference);
  for (std::size_t k = 0; k <= intervals; ++k) {
    nodes.nozzle.push_back(cursor.at(static_cast<double>(k) * period_s));
  }
  return nodes;
}

struct Defects {
  Form position;
  Form velocity;
};

// The defects of the interval that begins at node k.
Defects defects(const Nodes& nodes, const dynamics::FlexibleAxis& axis, std::size_t k) {
  const dynamics::NozzleMotion& p1 = nodes.nozzle[k];
  const dynamics::NozzleMotion& p2 = nodes.nozzle[k + 1];
  const double h = nodes.h;
  const double stiffness = axis.main_rad_s() * axis.main_rad_s();
  const double damping = 2.0 * axis.main_damping_ratio() * axis.main_rad_s();
  const Form one = unit(kConstant);
  const Form base1 = unit(kBase);
  const Form base2 = base1 + 0.5 * h * (unit(kNow) + unit(kNext));
  const auto force = [&](const Form& base, const Form& rate, double p, double p_rate) -> Form {
    return stiffness * (base - p * one) + damping * (rate - p_rate * one);
  };
  const Form f1 = force(base1, unit(kNow), p1.position, p1.velocity);
  const Form f2 = force(base2, unit(kNext), p2.position, p2.velocity);

  const double slope = -1.5 * (p1.position - p2.position) / h;
  const double slope_rate = -1.5 * (p1.velocity - p2.velocity) / h;
  const double sum_rate = p1.velocity + p2.velocity;
  const double middle = 0.5 * (p1.position + p2.position) + h / 8.0 * (p1.velocity - p2.velocity);
  const Form middle_rate = 0.5 * sum_rate * one + h / 8.0 * (f1 - f2);
  const Form f_middle = stiffness * (0.5 * (base1 + base2) - middle * one) +
                        damping * (0.5 * (unit(kNow) + unit(kNext)) - middle_rate);
  return {(slope - 0.25 * sum_rate) * one - middle_rate,
          slope_rate * one - 0.25 * (f1 + f2) - f_middle};
}

// The path of parabolas with these velocities at the nodes, from the base's position at the first
// node on.
AxisPath path_of(const Nodes& nodes, const std::vector<double>& velocity) {
  AxisPath path;
  double position = nodes.nozzle.front().position;
  for (std::size_t k = 0; k + 1 < nodes.count(); ++k) {
    path.push_back({static_cast<double>(k) * nodes.h,
                    {position, velocity[k], (velocity[k + 1] - velocity[k]) / nodes.h}});
    position += 0.5 * nodes.h * (velocity[k] + velocity[k + 1]);
  }
  path.push_back({static_cast<double>(nodes.count() - 1) * nodes.h, {position, 0.0, 0.0}});
  return path;
}

// Solves each form, which is to be zero, for v_{k+1}, starting from v_0 and the base's first
// position.
std::vector<double> substitute(const Nodes& nodes, const std::vector<Form>& forms,
                               double first_velocity) {
  std::vector<double> velocity = {first_velocity};
  double base = nodes.nozzle.front().position;
  for (std::size_t k = 0; k < forms.size(); ++k) {
    const Form& form = forms[k];
    const double before = k > 0 ? velocity[k - 1] : 0.0;
    const double rest =
        form(kBase) * base + form(kBefore) * before + form(kNow) * velocity[k] + form(kConstant);
    velocity.push_back(-rest / form(kNext));
    base += 0.5 * nodes.h * (velocity[k] + velocity[k + 1]);
  }
  return velocity;
}

}  // namespace

AxisPath thesis_least_squares(const AxisPath& reference, const dynamics::FlexibleAxis& axis,
                              double period_s) {
  using Rows = Eigen::Matrix<double, 6, 5>;
  const Nodes nodes = sample(reference, period_s);
  std::vector<Form> forms(nodes.count() - 1);
  // The rows that later intervals leave for (b_{k+1}, v_k, v_{k+1}).
  Eigen::Matrix<double, 3, 5> later = Eigen::Matrix<double, 3, 5>::Zero();
  for (std::size_t k = nodes.count() - 1; k-- > 0;) {
    Rows rows = Rows::Zero();
    const Defects of_interval = defects(nodes, axis, k);
    rows.row(0) = of_interval.position;
    rows.row(1) = of_interval.velocity;
    if (k > 0) {
      rows.row(2) =
          kJerkWeight / (nodes.h * nodes.h) * (unit(kBefore) - 2.0 * unit(kNow) + unit(kNext));
    }
    for (int i = 0; i < 3; ++i) {
      const Form form = later.row(i);
      rows.row(3 + i) = form(kBase) * (unit(kBase) + 0.5 * nodes.h * (unit(kNow) + unit(kNext))) +
                        form(kBefore) * unit(kNow) + form(kNow) * unit(kNext) +
                        form(kConstant) * unit(kConstant);
    }
    const Rows triangle =
        Eigen::HouseholderQR<Rows>(rows).matrixQR().triangularView<Eigen::Upper>();
    forms[k] = triangle.row(0);
    later = triangle.middleRows<3>(1);
  }
  // Only v_0 is left: in the row of the start, and in the rows that are left of the whole plan.
  double square = kStartWeight * kStartWeight;
  double product = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double rest = later(i, kBase) * nodes.nozzle.front().position + later(i, kConstant);
    square += later(i, kNow) * later(i, kNow);
    product += later(i, kNow) * rest;
  }
  return path_of(nodes, substitute(nodes, forms, -product / square));
}

AxisPath thesis_velocity_defects(const AxisPath& reference, const dynamics::FlexibleAxis& axis,
                                 double period_s) {
  const Nodes nodes = sample(reference, period_s);
  std::vector<Form> forms;
  for (std::size_t k = 0; k + 1 < nodes.count(); ++k) {
    forms.push_back(defects(nodes, axis, k).velocity);
  }
  return path_of(nodes, substitute(nodes, forms, 0.0));
}

}  // namespace unflex::rivals
