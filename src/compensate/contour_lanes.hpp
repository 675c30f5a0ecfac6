// The kernels of contour_kernel.hpp. Included once for each kind of lanes (unflex/core/lanes.hpp),
// so there is nothing here but templates over lanes, and nothing is included.
//
// Notation: P, groups of four pairs; 0: known at run time only.

namespace unflex::compensate {

template <class Lanes, std::size_t P>
class LaneContour final : public ContourKernel {
 public:
  explicit LaneContour(std::size_t pairs) : pairs_(pairs), groups_((pairs + kLanes - 1) / kLanes) {}

  [[nodiscard]] std::size_t pair_places() const override { return kLanes * groups(); }

  double follow(const std::vector<Edge>& edges, const std::vector<Reach>& reach,
                const Axes<PairNozzles>& nozzle, bool everywhere, PairPlaces& q) const override {
    // Number of edges looked at on either side of the edge found in the round before.
    constexpr std::size_t kAround = 2;
    const std::size_t places = pair_places();
    Lanes farthest = broadcast<Lanes>(0.0);
    for (std::size_t k = 0; k < reach.size(); ++k) {
      std::size_t from = reach[k].first;
      std::size_t to = reach[k].last;
      if (!everywhere) {
        double least = q.vertex[k * places];
        double most = least;
        for (std::size_t c = 1; c < pairs_; ++c) {
          const double vertex = q.vertex[k * places + c];
          least = vertex < least ? vertex : least;
          most = vertex > most ? vertex : most;
        }
        const auto first = static_cast<std::size_t>(least);
        const std::size_t last = static_cast<std::size_t>(most) + kAround;
        to = last < to ? last : to;
        from = first < from + kAround ? from : first - kAround;
        from = from < reach[k].last ? from : reach[k].last;
      }
      for (std::size_t group = 0; group < groups(); ++group) {
        const std::size_t place = k * places + kLanes * group;
        const Lanes px = nozzles(nozzle.x, k, group);
        const Lanes py = nozzles(nozzle.y, k, group);
        Lanes near_x = broadcast<Lanes>(edges[from].begin_mm.x);
        Lanes near_y = broadcast<Lanes>(edges[from].begin_mm.y);
        Lanes vertex = broadcast<Lanes>(static_cast<double>(from));
        Lanes least = square(near_x - px, near_y - py);
        const Lanes none = broadcast<Lanes>(0.0);
        const Lanes all = broadcast<Lanes>(1.0);
        for (std::size_t i = from; i < to; ++i) {
          const Edge& edge = edges[i];
          const Lanes begin_x = broadcast<Lanes>(edge.begin_mm.x);
          const Lanes begin_y = broadcast<Lanes>(edge.begin_mm.y);
          const Lanes along = edge.way_mm.x * (px - begin_x) + edge.way_mm.y * (py - begin_y);
          const Lanes share = smaller(larger(edge.inverse_square * along, none), all);
          const Lanes place_x = begin_x + edge.way_mm.x * share;
          const Lanes place_y = begin_y + edge.way_mm.y * share;
          const Lanes away = square(place_x - px, place_y - py);
          const auto is_nearer = less(away, least);
          least = select(is_nearer, away, least);
          near_x = select(is_nearer, place_x, near_x);
          near_y = select(is_nearer, place_y, near_y);
          vertex = select(is_nearer, broadcast<Lanes>(static_cast<double>(i)), vertex);
        }
        store(vertex, q.vertex.data() + place);
        farthest = larger(farthest, go(near_x, place, q.x));
        farthest = larger(farthest, go(near_y, place, q.y));
      }
    }
    return most(farthest);
  }

  void set_aims(const AimRule& rule, const LaneArray& q_mm, std::size_t nodes,
                LaneArray& node_aims_mm, LaneArray& middle_aims_mm) const override {
    for (std::size_t group = 0; group < rule.models / kLanes; ++group) {
      const double* const parts = rule.parts + kLanes * group;
      Lanes before = broadcast<Lanes>(0.0);  // how far q is from r, at the node before
      for (std::size_t k = 0; k < nodes; ++k) {
        const double r = rule.reference_mm[2 * k];
        const double* const q = q_mm.data() + k * pair_places();
        Lanes off = broadcast<Lanes>(0.0);
        for (std::size_t c = 0; c < pairs_; ++c) {
          off = off + (q[c] - r) * load<Lanes>(parts + c * rule.models);
        }
        const std::size_t place = k * rule.models + kLanes * group;
        store(broadcast<Lanes>(r) + (1.0 / (1.0 + rule.along[2 * k])) * off,
              node_aims_mm.data() + place);
        // In the middle between two nodes, the distance of q from r is the mean of the distances at
        // both nodes.
        if (k > 0) {
          store(broadcast<Lanes>(rule.reference_mm[2 * k - 1]) +
                    (0.5 / (1.0 + rule.along[2 * k - 1])) * (before + off),
                middle_aims_mm.data() + place - rule.models);
        }
        before = off;
      }
    }
  }

 private:
  // In a round q goes kStep times the way to the nearest place, plus the share kInertia of its way
  // in the round before.
  static constexpr double kStep = 2.8;
  static constexpr double kInertia = 0.45;

  [[nodiscard]] std::size_t groups() const {
    if constexpr (P > 0) {
      return P;
    } else {
      return groups_;
    }
  }

  [[nodiscard]] static Lanes square(const Lanes& x, const Lanes& y) { return x * x + y * y; }

  [[nodiscard]] Lanes nozzles(const PairNozzles& axis, std::size_t k, std::size_t group) const {
    const double* const p = axis.places_mm + k * axis.models;
    const std::size_t* const of = axis.of_pair + kLanes * group;
    return gathered<Lanes>(p[of[0]], p[of[1]], p[of[2]], p[of[3]]);
  }

  // Moves q, and returns how far it went.
  [[nodiscard]] static Lanes go(const Lanes& nearest, std::size_t place, PairCoordinate& q) {
    const Lanes at = load<Lanes>(q.place_mm.data() + place);
    const Lanes way = kInertia * load<Lanes>(q.way_mm.data() + place) + kStep * (nearest - at);
    store(way, q.way_mm.data() + place);
    store(at + way, q.place_mm.data() + place);
    return larger(way, -1.0 * way);
  }

  std::size_t pairs_ = 0;
  std::size_t groups_ = 0;
};

template <class Lanes>
std::unique_ptr<ContourKernel> fitting_contour(std::size_t pairs) {
  if (pairs <= kLanes) {
    return std::make_unique<LaneContour<Lanes, 1>>(pairs);
  }
  if (pairs <= 2 * kLanes) {
    return std::make_unique<LaneContour<Lanes, 2>>(pairs);
  }
  return std::make_unique<LaneContour<Lanes, 0>>(pairs);
}

}  // namespace unflex::compensate
