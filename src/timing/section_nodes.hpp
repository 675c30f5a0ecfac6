// Nodes along a section, and which part of its path belongs to which.
//
//   u   place among nodes, k + x: between node k and the next, 0 ≤ x ≤ 1
//
// A first plan passes the nodes evenly. Its vertices are bound to the u at which it passes them, so
// that a motion which comes from it by small steps finds its way. Between such vertices a place on
// the motion belongs to the leg that it is nearest to.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sections.hpp"
#include "tunings.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::timing {

[[nodiscard]] XY start_of(const Leg& leg);
[[nodiscard]] XY direction_of(const Leg& leg);

class SectionNodes {
 public:
  // node_s: time from node to node, nearly. The section must outlive this.
  SectionNodes(const Section& section, double node_s);

  // Node periods, one less than nodes.
  [[nodiscard]] std::size_t periods() const { return periods_; }
  [[nodiscard]] double period_s() const { return period_s_; }
  // Where the first plan is at a node.
  [[nodiscard]] XY place(std::size_t node) const { return places_[node]; }

  // A vertex that is bound.
  struct Pin {
    std::size_t vertex = 0;  // the leg that begins there
    std::size_t k = 0;
    double x = 0.0;
  };
  [[nodiscard]] std::span<const Pin> pins() const { return pins_; }

  // The leg at u that the nozzle is nearest to.
  [[nodiscard]] std::size_t nearest_leg(std::size_t k, double x, XY nozzle) const;
  // How far along a leg the nozzle is; its ends are the farthest.
  [[nodiscard]] double along_mm(std::size_t leg, XY nozzle) const;
  // How far the nozzle is from the path around u.
  [[nodiscard]] double error_mm(std::size_t k, double x, XY nozzle) const;

  // The limits of the nozzle on a leg, at u. Beside filament, travel keeps the limits of filament,
  // since lines do not end exactly where filament does.
  // beside: how near to filament that is, in node periods.
  [[nodiscard]] double tolerance_mm(std::size_t leg, std::size_t k, double x,
                                    double beside = OptimalTunings::kBesideInRows) const;
  [[nodiscard]] double feed_mm_s(std::size_t leg, std::size_t k, double x) const;
  // Whether a vertex is bound and near to u. vertex: the number of the leg that begins there.
  [[nodiscard]] bool is_near_vertex(std::size_t vertex, std::size_t k, double x) const;

 private:
  struct Range {
    std::size_t first = 0;
    std::size_t last = 0;
  };
  // The legs between the bound vertices around u.
  [[nodiscard]] Range legs(std::size_t k, double x) const;
  void bind(const std::vector<double>& begins);

  std::span<const Leg> legs_;
  std::size_t periods_ = 0;
  double period_s_ = 0.0;
  std::vector<XY> places_;
  std::vector<Pin> pins_;
  std::vector<std::size_t> first_pin_;  // that comes after node k
};

}  // namespace unflex::timing
