// What contour.cpp does at each node in each round. Pairs lie in lanes, and so do the models that
// they are made of (unflex/core/lanes.hpp).
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

// From which vertex to which the path lies within a node's reach.
struct Reach {
  std::size_t first = 0;
  std::size_t last = 0;
};

// A coordinate of q, and by how much it moved in the last round: of each pair at the nodes,
// pair_places() numbers each.
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

// How an axis comes to its aims.
struct AimRule {
  const double* reference_mm = nullptr;  // r, at nodes and middles
  const double* along = nullptr;         // ε + λ likewise
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
  // Takes q farther towards the places nearest to the nozzles: everywhere within the reach, or near
  // where it was. Returns the longest way that a q went, mm.
  virtual double follow(const std::vector<Edge>& edges, const std::vector<Reach>& reach,
                        const Axes<PairNozzles>& nozzle, bool everywhere, PairPlaces& q) const = 0;
  // Aims of each model at the nodes and in the middles behind them.
  virtual void set_aims(const AimRule& rule, const LaneArray& q_mm, std::size_t nodes,
                        LaneArray& node_aims_mm, LaneArray& middle_aims_mm) const = 0;
};

// The kernel for so many pairs, by the processor's registers.
[[nodiscard]] std::unique_ptr<ContourKernel> make_contour_kernel(std::size_t pairs);

}  // namespace unflex::compensate
