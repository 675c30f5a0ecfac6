#include "contour.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "free_solver.hpp"

namespace unflex::compensate {
namespace {

constexpr int kRounds = 5;
// In so many rounds the nearest place is looked for as far as the contour reaches.
constexpr int kWideRounds = 2;
constexpr std::size_t kAround = 2;  // edges
// How far q goes in a round: so many times the way to the nearest place, and this share of the way
// that it went in the round before.
constexpr double kStep = 2.8;
constexpr double kInertia = 0.45;
// What q may still move by when it counts as found.
constexpr double kSettled_mm = 3e-4;
constexpr double kCornerReach_s = 1e-3;

struct Place {
  double x_mm = 0.0;
  double y_mm = 0.0;
  std::size_t vertex = 0;  // where the edge begins that it lies on
  double by_x_mm = 0.0;    // the way of the last round
  double by_y_mm = 0.0;
};

// An edge of the path: from a vertex to the next.
struct Edge {
  double x_mm = 0.0;
  double y_mm = 0.0;
  double dx_mm = 0.0;
  double dy_mm = 0.0;
  double inverse_square = 0.0;  // of its length; 0 if it has none
};

std::vector<Edge> edges_of(const std::vector<PathVertex>& path) {
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const PathVertex& next = path[std::min(i + 1, path.size() - 1)];
    const double dx = next.x_mm - path[i].x_mm;
    const double dy = next.y_mm - path[i].y_mm;
    const double square = dx * dx + dy * dy;
    edges.push_back({path[i].x_mm, path[i].y_mm, dx, dy, square > 0.0 ? 1.0 / square : 0.0});
  }
  return edges;
}

// The place nearest to p on the edges from vertex `first` to vertex `last`.
Place nearest(const std::vector<Edge>& edges, std::size_t first, std::size_t last, const Place& p) {
  Place found{edges[first].x_mm, edges[first].y_mm, first};
  double least =
      (found.x_mm - p.x_mm) * (found.x_mm - p.x_mm) + (found.y_mm - p.y_mm) * (found.y_mm - p.y_mm);
  for (std::size_t i = first; i < last; ++i) {
    const Edge& edge = edges[i];
    const double s =
        std::clamp(((p.x_mm - edge.x_mm) * edge.dx_mm + (p.y_mm - edge.y_mm) * edge.dy_mm) *
                       edge.inverse_square,
                   0.0, 1.0);
    const Place place{edge.x_mm + s * edge.dx_mm, edge.y_mm + s * edge.dy_mm, i};
    const double away = (place.x_mm - p.x_mm) * (place.x_mm - p.x_mm) +
                        (place.y_mm - p.y_mm) * (place.y_mm - p.y_mm);
    if (away < least) {
      least = away;
      found = place;
    }
  }
  return found;
}

class Aiming {
 public:
  explicit Aiming(RunWindow& window)
      : window_(window),
        contour_(*window.contour),
        samples_(window.x.reference_mm.size()),
        nodes_(window.x.nodes()),
        edges_(edges_of(window.path)) {
    set_along_weights();
    for (std::size_t i = 0; i < samples_; ++i) {
      const double factor = 1.0 + along_[i];
      window_.x.weight[i] *= factor;
      window_.y.weight[i] *= factor;
    }
    std::vector<Place> reference;
    for (std::size_t k = 0; k < nodes_; ++k) {
      reference.push_back({window_.x.reference_mm[2 * k], window_.y.reference_mm[2 * k]});
    }
    nearest_.assign(contour_.pairs.size(), reference);
    set_aims();
  }

  void set_aims() {
    aims_of(
        window_.x, [](const ModelPair& pair) { return pair.x; },
        [](const Place& place) { return place.x_mm; });
    aims_of(
        window_.y, [](const ModelPair& pair) { return pair.y; },
        [](const Place& place) { return place.y_mm; });
  }

  // Takes q farther towards the places nearest to the nozzles. x_mm and y_mm: of each model at each
  // node. Returns the longest way that a q went.
  double follow(const std::vector<std::vector<double>>& x_mm,
                const std::vector<std::vector<double>>& y_mm, bool everywhere) {
    const double reach = 2.0 * contour_.reach_s / window_.x.period_s;
    const std::vector<PathVertex>& path = window_.path;
    std::size_t first = 0;
    std::size_t last = 0;
    double farthest = 0.0;
    for (std::size_t k = 0; k < nodes_; ++k) {
      const auto now = static_cast<double>(2 * k);
      while (first + 1 < path.size() && path[first + 1].sample < now - reach) {
        ++first;
      }
      while (last + 1 < path.size() && path[last].sample < now + reach) {
        ++last;
      }
      for (std::size_t c = 0; c < contour_.pairs.size(); ++c) {
        const ModelPair& pair = contour_.pairs[c];
        Place& q = nearest_[c][k];
        const std::size_t around = q.vertex;
        const std::size_t from =
            everywhere || around < first + kAround ? first : std::min(around - kAround, last);
        const std::size_t to = everywhere ? last : std::min(last, around + kAround);
        const Place found = nearest(edges_, from, to, {x_mm[pair.x][k], y_mm[pair.y][k]});
        q.by_x_mm = kInertia * q.by_x_mm + kStep * (found.x_mm - q.x_mm);
        q.by_y_mm = kInertia * q.by_y_mm + kStep * (found.y_mm - q.y_mm);
        q.x_mm += q.by_x_mm;
        q.y_mm += q.by_y_mm;
        q.vertex = found.vertex;
        farthest = std::max({farthest, std::abs(q.by_x_mm), std::abs(q.by_y_mm)});
      }
    }
    return farthest;
  }

 private:
  // ε + λ of each sample.
  void set_along_weights() {
    along_.assign(samples_, contour_.along_weight);
    const double reach = 2.0 * kCornerReach_s / window_.x.period_s;
    for (const PathVertex& vertex : window_.path) {
      if (vertex.is_sharp) {
        const double from = std::max(std::ceil(vertex.sample - reach), 0.0);
        for (auto i = static_cast<std::size_t>(from);
             i < samples_ && static_cast<double>(i) <= vertex.sample + reach; ++i) {
          along_[i] = contour_.along_weight + contour_.corner_weight;
        }
      }
    }
  }

  // In the middle between two nodes q is as far from r as on the average of both.
  template <class Model, class Coordinate>
  void aims_of(AxisWindow& axis, const Model& model_of, const Coordinate& coordinate) {
    const std::vector<double>& r = axis.reference_mm;
    axis.aims_mm.resize(axis.models());
    for (std::size_t m = 0; m < axis.models(); ++m) {
      std::vector<double>& aim = axis.aims_mm[m];
      mean_mm_.assign(nodes_, 0.0);
      double share = 0.0;
      for (std::size_t c = 0; c < contour_.pairs.size(); ++c) {
        if (model_of(contour_.pairs[c]) == m) {
          share += contour_.pairs[c].share;
          for (std::size_t k = 0; k < nodes_; ++k) {
            mean_mm_[k] += contour_.pairs[c].share * coordinate(nearest_[c][k]);
          }
        }
      }
      aim = r;
      if (share == 0.0) {
        // No pair holds this model, as its share is zero. So its aim has no weight.
        continue;
      }
      double before_mm = 0.0;  // how far q is from r, at the node before
      for (std::size_t k = 0; k < nodes_; ++k) {
        const double off_mm = mean_mm_[k] / share - r[2 * k];
        aim[2 * k] += off_mm / (1.0 + along_[2 * k]);
        if (k > 0) {
          aim[2 * k - 1] += 0.5 * (before_mm + off_mm) / (1.0 + along_[2 * k - 1]);
        }
        before_mm = off_mm;
      }
    }
  }

  RunWindow& window_;
  const Contour& contour_;
  std::size_t samples_;
  std::size_t nodes_;
  std::vector<Edge> edges_;
  std::vector<double> along_;
  std::vector<std::vector<Place>> nearest_;  // q of each pair, at the nodes
  std::vector<double> mean_mm_;
};

// Models by rising frequency.
struct ModelShare {
  std::size_t model = 0;
  double freq_rad_s = 0.0;
  double share = 0.0;
};

std::vector<ModelShare> by_frequency(const AxisSetup& setup) {
  std::vector<ModelShare> models = {{0, setup.axis.main_rad_s(), 1.0}};
  for (std::size_t i = 0; i < setup.plants.size(); ++i) {
    const Plant& plant = setup.plants[i];
    models.push_back({i + 1, plant.axis.main_rad_s(), plant.share});
    models.front().share -= plant.share;
  }
  std::ranges::stable_sort(models, {}, &ModelShare::freq_rad_s);
  return models;
}

// Adds the pairs that give each model its share and that go through both lists in their order.
void add_in_order(std::vector<ModelShare> x, std::vector<ModelShare> y, double weight,
                  std::vector<ModelPair>& pairs) {
  constexpr double kNothing = 1e-9;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < x.size() && j < y.size()) {
    const double share = std::min(x[i].share, y[j].share);
    if (share > kNothing) {
      const auto known = std::ranges::find_if(pairs, [&](const ModelPair& pair) {
        return pair.x == x[i].model && pair.y == y[j].model;
      });
      if (known == pairs.end()) {
        pairs.push_back({x[i].model, y[j].model, weight * share});
      } else {
        known->share += weight * share;
      }
    }
    x[i].share -= share;
    y[j].share -= share;
    i += x[i].share <= kNothing ? 1 : 0;
    j += y[j].share <= kNothing ? 1 : 0;
  }
}

}  // namespace

std::vector<PathVertex> path_of(const Course& course, double origin_s, double period_s) {
  std::vector<PathVertex> path;
  double time_s = origin_s - planner::duration_s(course.before);
  const gcode::Position* direction = nullptr;  // of the last move in X and Y
  const auto add = [&](const gcode::Position& place, bool sharp) {
    path.push_back({place[gcode::X], place[gcode::Y], 2.0 * time_s / period_s, sharp});
  };
  for (const Course::Moves& moves : {course.before, course.moves, course.after}) {
    for (const planner::PlannedMove& move : moves) {
      if (path.empty()) {
        add(move.position_mm(0.0), true);
      }
      time_s += move.duration_s();
      const bool is_flat = move.direction[gcode::X] != 0.0 || move.direction[gcode::Y] != 0.0;
      if (is_flat && direction != nullptr && planner::turns_sharply(*direction, move.direction)) {
        path.back().is_sharp = true;
      }
      direction = is_flat ? &move.direction : direction;
      add(move.position_mm(move.duration_s()), false);
    }
  }
  path.back().is_sharp = true;
  return path;
}

std::vector<PathVertex> part_of(const std::vector<PathVertex>& path, std::size_t first,
                                std::size_t samples, double reach) {
  const double from = static_cast<double>(first) - reach;
  const double to = static_cast<double>(first + samples) + reach;
  const auto begin = std::ranges::lower_bound(path, from, {}, &PathVertex::sample);
  const auto end = std::ranges::upper_bound(path, to, {}, &PathVertex::sample);
  std::vector<PathVertex> part(begin == path.begin() ? begin : begin - 1,
                               end == path.end() ? end : end + 1);
  for (PathVertex& vertex : part) {
    vertex.sample -= static_cast<double>(first);
  }
  return part;
}

std::vector<ModelPair> pairs_of(const AxisSetup& x, const AxisSetup& y) {
  constexpr double kOppositeWays = 0.3;
  std::vector<ModelPair> pairs;
  std::vector<ModelShare> of_y = by_frequency(y);
  add_in_order(by_frequency(x), of_y, 1.0 - kOppositeWays, pairs);
  std::ranges::reverse(of_y);
  add_in_order(by_frequency(x), of_y, kOppositeWays, pairs);
  return pairs;
}

FreeSolutions aim(RunWindow& window) {
  Aiming aiming(window);
  FreeSolver x(window.x);
  FreeSolver y(window.y);
  if (!x.is_ready() || !y.is_ready()) {
    return {};
  }
  for (int round = 0; round < kRounds; ++round) {
    x.solve();
    y.solve();
    const double farthest = aiming.follow(x.nozzles_mm(), y.nozzles_mm(), round < kWideRounds);
    aiming.set_aims();
    if (farthest < kSettled_mm) {
      break;
    }
  }
  return {x.solution(), y.solution()};
}

}  // namespace unflex::compensate
