// The work of contour.cpp at each node in each round. Pairs lie in lanes, and so do their models
// (unflex/core/lanes.hpp).
//
// Notation is that of contour.hpp.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "lane_array.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::compensate {

// An edge of the path: from a vertex to the next.
struct Edge {
  XY begin_mm;
  XY way_mm;
  double inverse_square = 0.0;  // of its length; 0 if it has none
};

// The range of vertices between which the path lies within a node's reach.
struct Reach {
  std::size_t first = 0;
  std::size_t last = 0;
};

// A coordinate of q, and its change in the last round. Each node has pair_places() numbers, one
// after the other for the pairs.
struct PairCoordinate {
  LaneArray place_mm;
  LaneArray way_mm;
};

struct PairPlaces : Axes<PairCoordinate> {
  LaneArray vertex;  // where the edge begins that q lies on
};

// The nozzles of an axis: p of each model at the nodes, and the model of each pair.
struct PairNozzles {
  const double* places_mm = nullptr;
  std::size_t models = 0;  // places for models at each node
  const std::size_t* of_pair = nullptr;
};

// The rule by which the aims of an axis follow from q.
struct AimRule {
  const double* reference_mm = nullptr;  // r, at nodes and middles
  const double* along = nullptr;         // ε + λ, at nodes and middles
  // Each pair's part in the aim of each model: pair_places() rows of `models` numbers.
  const double* parts = nullptr;
  std::size_t models = 0;
};

class ContourKernel {
 public:
  ContourKernel() = default;
  ContourKernel(const ContourKernel&) = delete;
  ContourKernel& operator=(const ContourKernel&) = delete;
  virtual ~ContourKernel() = default;

  [[nodiscard]] virtual std::size_t pair_places() const = 0;
  // Moves each q towards the place nearest to its nozzle. The place is looked for everywhere within
  // the reach, or near the last q. Returns the longest way that a q went, mm.
  virtual double follow(const std::vector<Edge>& edges, const std::vector<Reach>& reach,
                        const Axes<PairNozzles>& nozzle, bool everywhere, PairPlaces& q) const = 0;
  // Aims of each model at the nodes and in the middles behind them.
  virtual void set_aims(const AimRule& rule, const LaneArray& q_mm, std::size_t nodes,
                        LaneArray& node_aims_mm, LaneArray& middle_aims_mm) const = 0;
};

// The kernel for this number of pairs, by the processor's registers.
[[nodiscard]] std::unique_ptr<ContourKernel> make_contour_kernel(std::size_t pairs);

}  // namespace unflex::compensate
