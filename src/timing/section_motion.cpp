// A section's motion as the splines that its search has found.
#include "section_motion.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "section_nodes.hpp"
#include "section_search.hpp"
#include "section_spline.hpp"

namespace unflex::timing {
namespace {

template <int D>
class SplineMotion : public SectionMotion {
 public:
  explicit SplineMotion(const SectionSearch<D>& found)
      : spline_(found.spline()), nodes_(found.nodes()), edge_nozzles_(found.edge_nozzles()) {
    for (std::size_t k = 0; k < spline_.periods(); ++k) {
      times_.push_back(clock(k, 0.0));
    }
    times_.push_back(clock(spline_.periods() - 1, 1.0));
  }

  [[nodiscard]] double duration_s() const override {
    return (times_.back() - times_.front()) * spline_.period_s();
  }

  [[nodiscard]] Base base(double t) const override {
    const double wanted =
        std::clamp(times_.front() + t / spline_.period_s(), times_.front(), times_.back());
    const auto next = std::upper_bound(times_.begin() + 1, times_.end() - 1, wanted);
    const auto k = static_cast<std::size_t>(next - times_.begin()) - 1;
    constexpr int kNewtonSteps = 4;
    double x = (wanted - times_[k]) / (times_[k + 1] - times_[k]);
    SplineShares<D> shares = spline_shares<D>(x);
    for (int i = 0; i < kNewtonSteps; ++i) {
      const double late = spline_.clock(k, shares) - wanted;
      const double nearer = std::clamp(x - late / spline_.clock(k, shares, 1), 0.0, 1.0);
      if (nearer == x) {
        break;
      }
      x = nearer;
      shares = spline_shares<D>(x);
    }
    using Spline = SectionSpline<D>;
    const auto at = spline_.place(k, shares);
    return map_axes(
        [](double place_mm, double speed_mm_s) {
          return OfAxis{place_mm, speed_mm_s};
        },
        spline_.origin() + Spline::apply(spline_.flat().base, at),
        Spline::apply(spline_.flat().base_speed, at) / spline_.period_s());
  }

  [[nodiscard]] std::vector<dynamics::NozzleXY> edge_nozzles() const override {
    return edge_nozzles_;
  }

  [[nodiscard]] std::vector<Passage> passages() const override {
    std::vector<Passage> result;
    const auto add = [&](std::size_t k, double x) {
      const XY p = spline_.nozzle_mm(spline_.place(k, spline_shares<D>(x)));
      const std::size_t leg = nodes_.nearest_leg(k, x, p);
      result.push_back(
          {(clock(k, x) - times_.front()) * spline_.period_s(), leg, nodes_.along_mm(leg, p)});
    };
    for (std::size_t k = 0; k < spline_.periods(); ++k) {
      add(k, 0.0);
      add(k, 0.5);
    }
    add(spline_.periods() - 1, 1.0);
    return result;
  }

 private:
  [[nodiscard]] double clock(std::size_t k, double x) const {
    return spline_.clock(k, spline_shares<D>(x));
  }

  SectionSpline<D> spline_;
  SectionNodes nodes_;
  std::vector<dynamics::NozzleXY> edge_nozzles_;
  std::vector<double> times_;  // T at the nodes
};

template <int D>
std::unique_ptr<SectionMotion> motion(const Section& section, const SectionRules& rules) {
  SectionSearch<D> search(section, rules);
  return search.solve() ? std::make_unique<SplineMotion<D>>(search) : nullptr;
}

}  // namespace

std::unique_ptr<SectionMotion> fastest_motion(const Section& section, const SectionRules& rules) {
  return !rules.edges.empty() ? motion<7>(section, rules) : motion<5>(section, rules);
}

}  // namespace unflex::timing
