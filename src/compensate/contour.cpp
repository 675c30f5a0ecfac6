#include "contour.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "contour_kernel.hpp"
#include "free_steps.hpp"
#include "stage_form.hpp"

namespace unflex::compensate {
namespace {

constexpr int kRounds = 5;
// The first rounds, in which the nearest place is looked for as far as the contour reaches.
constexpr int kWideRounds = 2;
// q counts as found once a round moves it by no more.
constexpr double kSettled_mm = 3e-4;
constexpr double kCornerReach_s = 1e-3;

std::vector<Edge> edges_of(const std::vector<PathVertex>& path) {
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const PathVertex& next = path[std::min(i + 1, path.size() - 1)];
    const XY way_mm = next.place_mm - path[i].place_mm;
    const double square = squared(way_mm);
    edges.push_back({path[i].place_mm, way_mm, square > 0.0 ? 1.0 / square : 0.0});
  }
  return edges;
}

// ε + λ of each sample.
std::vector<double> along_weights(const RunWindow& window) {
  const Contour& contour = *window.contour;
  const std::size_t samples = window.x.reference_mm.size();
  std::vector<double> along(samples, contour.along_weight);
  const double reach = 2.0 * kCornerReach_s / window.x.period_s;
  for (const PathVertex& vertex : window.path) {
    if (vertex.is_sharp) {
      const double from = std::max(std::ceil(vertex.sample - reach), 0.0);
      for (auto i = static_cast<std::size_t>(from);
           i < samples && static_cast<double>(i) <= vertex.sample + reach; ++i) {
        along[i] = contour.along_weight + contour.corner_weight;
      }
    }
  }
  return along;
}

std::vector<Reach> reaches_of(const RunWindow& window) {
  const double reach = 2.0 * window.contour->reach_s / window.x.period_s;
  const std::vector<PathVertex>& path = window.path;
  std::vector<Reach> result;
  result.reserve(window.x.nodes());
  Reach at;
  for (std::size_t k = 0; k < window.x.nodes(); ++k) {
    const auto now = static_cast<double>(2 * k);
    while (at.first + 1 < path.size() && path[at.first + 1].sample < now - reach) {
      ++at.first;
    }
    while (at.last + 1 < path.size() && path[at.last].sample < now + reach) {
      ++at.last;
    }
    result.push_back(at);
  }
  return result;
}

// An axis of a window: its factored program, and the rule for its aims. The program is factored
// once, since its matrix does not depend on the aims.
class AimedAxis {
 public:
  // axis: its number in a pair. along: ε + λ of each sample. All of them must stay where they are.
  AimedAxis(AxisWindow& window, const std::vector<ModelPair>& pairs, std::size_t axis,
            const std::vector<double>& along, const ContourKernel& kernel)
      : window_(window), along_(along), kernel_(kernel) {
    scaled_.assign(window_);
    form_.assign(scaled_);
    ready_ = form_.factor({});
    of_pair_.assign(kernel.pair_places(), pairs.front()[axis]);
    parts_.resize(kernel.pair_places() * form_.model_places());
    std::fill_n(parts_.data(), parts_.size(), 0.0);
    std::vector<double> shares(window_.models());
    for (const ModelPair& pair : pairs) {
      shares[pair[axis]] += pair.share;
    }
    // A model that no pair holds has no share, and keeps r as its aim.
    for (std::size_t c = 0; c < pairs.size(); ++c) {
      const std::size_t model = pairs[c][axis];
      of_pair_[c] = model;
      if (shares[model] > 0.0) {
        parts_[c * form_.model_places() + model] = pairs[c].share / shares[model];
      }
    }
    const std::size_t aims = window_.nodes() * form_.model_places();
    node_aims_mm_.resize(aims);
    middle_aims_mm_.resize(aims);
  }
  // The form points to the scaled window.
  AimedAxis(const AimedAxis&) = delete;
  AimedAxis& operator=(const AimedAxis&) = delete;

  [[nodiscard]] bool is_ready() const { return ready_; }

  // q at the reference.
  [[nodiscard]] PairCoordinate reference() const {
    const std::size_t pairs = kernel_.pair_places();
    PairCoordinate q;
    q.place_mm.resize(window_.nodes() * pairs);
    q.way_mm.resize(q.place_mm.size());
    for (std::size_t k = 0; k < window_.nodes(); ++k) {
      std::fill_n(q.place_mm.data() + k * pairs, pairs, window_.reference_mm[2 * k]);
    }
    std::fill_n(q.way_mm.data(), q.way_mm.size(), 0.0);
    return q;
  }

  // Takes the form from the reference to the optimum.
  void solve_first() { form_.step_to_optimum(); }
  // Takes the form from the optimum for the previous aims to the optimum for aims at q.
  void follow(const PairCoordinate& q) {
    set_aims(q);
    form_.follow_aims(node_aims_mm_, middle_aims_mm_);
  }
  [[nodiscard]] PairNozzles nozzles() {
    form_.write_nozzles(nozzles_mm_);
    return {nozzles_mm_.data(), form_.model_places(), of_pair_.data()};
  }

  // The optimum for aims at q. They become the window's aims. nullopt if rounding keeps the form
  // from the optimum.
  [[nodiscard]] std::optional<AxisSolution> finish(const PairCoordinate& q) {
    follow(q);
    const std::size_t places = form_.model_places();
    window_.aims_mm.resize(window_.models());
    for (std::size_t c = 0; c < window_.models(); ++c) {
      std::vector<double>& aim_mm = window_.aims_mm[c];
      aim_mm.resize(window_.reference_mm.size());
      for (std::size_t k = 0; k < window_.nodes(); ++k) {
        aim_mm[2 * k] = node_aims_mm_[k * places + c];
        if (k + 1 < window_.nodes()) {
          aim_mm[2 * k + 1] = middle_aims_mm_[k * places + c];
        }
      }
    }
    return step_without_limits(form_, scaled_.nodes) ? std::optional(solution_of(form_, scaled_))
                                                     : std::nullopt;
  }

 private:
  void set_aims(const PairCoordinate& q) {
    kernel_.set_aims(
        {window_.reference_mm.data(), along_.data(), parts_.data(), form_.model_places()},
        q.place_mm, window_.nodes(), node_aims_mm_, middle_aims_mm_);
  }

  AxisWindow& window_;
  const std::vector<double>& along_;
  const ContourKernel& kernel_;
  ScaledWindow scaled_;
  StageForm form_;
  bool ready_ = false;
  std::vector<std::size_t> of_pair_;
  LaneArray parts_;
  LaneArray node_aims_mm_;
  LaneArray middle_aims_mm_;
  LaneArray nozzles_mm_;
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
void add_in_order(const Axes<std::vector<ModelShare>>& models, double weight,
                  std::vector<ModelPair>& pairs) {
  constexpr double kNothing = 1e-9;
  using Models = std::span<const ModelShare>;
  Axes<Models> left = map_axes([](const auto& all) { return Models(all); }, models);
  Axes<double> left_share = map_axes([](Models all) { return all.front().share; }, left);
  const auto is_used_up = [](Models all) { return all.empty(); };
  while (!any_axis(is_used_up, left)) {
    const double share = least_of_axes(std::identity{}, left_share);
    const Axes<std::size_t> of_axes = map_axes([](Models all) { return all.front().model; }, left);
    if (share > kNothing) {
      const auto known = std::ranges::find_if(
          pairs, [&](const Axes<std::size_t>& pair) { return pair == of_axes; });
      if (known == pairs.end()) {
        pairs.push_back({of_axes, weight * share});
      } else {
        known->share += weight * share;
      }
    }
    for_each_axis(
        [&](Models& all, double& of_first) {
          of_first -= share;
          if (of_first <= kNothing) {
            all = all.subspan(1);
            of_first = all.empty() ? 0.0 : all.front().share;
          }
        },
        left, left_share);
  }
}

}  // namespace

std::vector<PathVertex> path_of(const Course& course, double origin_s, double period_s) {
  std::vector<PathVertex> path;
  double time_s = origin_s - planner::duration_s(course.before);
  const gcode::Position* direction = nullptr;  // of the last move in X and Y
  const auto add = [&](const gcode::Position& place, bool sharp) {
    path.push_back({xy_of(place), 2.0 * time_s / period_s, sharp});
  };
  for (const Course::Moves& moves : {course.before, course.moves, course.after}) {
    for (const planner::PlannedMove& move : moves) {
      if (path.empty()) {
        add(move.position_mm(0.0), true);
      }
      time_s += move.duration_s();
      const bool is_flat = xy_of(move.direction) != XY{};
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

std::vector<ModelPair> pairs_of(const Axes<AxisSetup>& setup) {
  constexpr double kOppositeWays = 0.3;
  std::vector<ModelPair> pairs;
  Axes<std::vector<ModelShare>> models = map_axes(by_frequency, setup);
  add_in_order(models, 1.0 - kOppositeWays, pairs);
  std::ranges::reverse(models.y);
  add_in_order(models, kOppositeWays, pairs);
  return pairs;
}

FreeSolutions aim(RunWindow& window) {
  const std::vector<ModelPair>& pairs = window.contour->pairs;
  const std::unique_ptr<ContourKernel> kernel = make_contour_kernel(pairs.size());
  const std::vector<Edge> edges = edges_of(window.path);
  const std::vector<Reach> reaches = reaches_of(window);
  const std::vector<double> along = along_weights(window);
  for (std::size_t i = 0; i < along.size(); ++i) {
    for_each_axis([&](AxisWindow& axis) { axis.weight[i] *= 1.0 + along[i]; }, window);
  }
  Axes<std::unique_ptr<AimedAxis>> axes;
  for (std::size_t axis = 0; axis < axes.kCount; ++axis) {
    axes[axis] = std::make_unique<AimedAxis>(window[axis], pairs, axis, along, *kernel);
  }
  if (!all_axes([](const auto& axis) { return axis->is_ready(); }, axes)) {
    return {};
  }
  PairPlaces q{map_axes([](const auto& axis) { return axis->reference(); }, axes), {}};
  q.vertex.resize(q.x.place_mm.size());
  std::fill_n(q.vertex.data(), q.vertex.size(), 0.0);
  for_each_axis([](auto& axis) { axis->solve_first(); }, axes);
  for (int round = 0;; ++round) {
    const auto nozzles = map_axes([](const auto& axis) { return axis->nozzles(); }, axes);
    const double farthest_mm = kernel->follow(edges, reaches, nozzles, round < kWideRounds, q);
    if (farthest_mm < kSettled_mm || round + 1 == kRounds) {
      return map_axes(
          [](const auto& axis, const PairCoordinate& of_axis) { return axis->finish(of_axis); },
          axes, q);
    }
    for_each_axis([](auto& axis, const PairCoordinate& of_axis) { axis->follow(of_axis); }, axes,
                  q);
  }
}

}  // namespace unflex::compensate
