#include "layer_store.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::record {
namespace {

constexpr double kUnitsPerMm = 100.0;
// About how many bytes a point and the head of a path take.
constexpr std::size_t kPointBytes = 4;
constexpr std::size_t kPathBytes = 9;
// Beyond this tolerance layers are left out instead, 0.01 mm.
constexpr double kCoarsest = 8.0;
constexpr std::size_t kMostLeftOut = 64;
// Length of the shortest stretches per tolerance, once the store is coarser.
constexpr double kLeastPerTolerance = 30.0;
// Deviation codes up to kAlike apart are drawn as one, and kAlikePerLevel more per coarser level.
// Codes below kSmall all look alike.
constexpr int kAlike = 3;
constexpr int kAlikePerLevel = 2;
constexpr unsigned char kSmall = 40;
// Share of the whole length that may lie outside of the print's rectangle, on each side.
constexpr double kOutside = 0.003;
// When the store is too large, it is made coarser until it fills this share of the budget.
constexpr double kFill = 0.75;

std::int32_t units(double mm) {
  constexpr double kFarthest = 1e9;
  return static_cast<std::int32_t>(
      std::lround(std::clamp(std::isfinite(mm) ? mm * kUnitsPerMm : 0.0, -kFarthest, kFarthest)));
}

void put(std::size_t number, std::string& bytes) {
  for (; number >= 0x80U; number >>= 7U) {
    bytes += static_cast<char>((number & 0x7FU) | 0x80U);
  }
  bytes += static_cast<char>(number);
}

void put_signed(std::int64_t number, std::string& bytes) {
  const auto magnitude = static_cast<std::size_t>(number < 0 ? -number : number);
  put(number < 0 ? 2 * magnitude - 1 : 2 * magnitude, bytes);
}

}  // namespace

void LayerStore::add(const Stretch& stretch) {
  if (stretch.layer % layer_step_ != 0) {
    return;
  }
  const Point start{map_axes(units, stretch.from_mm)};
  if (!continues(stretch, start)) {
    begin_path({points_.size(), stretch.layer, stretch.feature, stretch.line, stretch.line}, start);
  }
  paths_.back().last_line = stretch.line;
  extend({map_axes(units, stretch.to_mm), stretch.before, stretch.after});
  while (size_bytes() > budget_bytes_) {
    do {
      coarsen();
    } while (static_cast<double>(size_bytes()) > kFill * static_cast<double>(budget_bytes_));
  }
}

bool LayerStore::continues(const Stretch& stretch, const Point& start) const {
  if (paths_.empty()) {
    return false;
  }
  const Path& path = paths_.back();
  const Point& last = points_.back();
  return path.layer == stretch.layer && path.feature == stretch.feature && last.at == start.at;
}

void LayerStore::begin_path(const Path& head, const Point& start) {
  paths_.push_back(head);
  points_.push_back(start);
  may_merge_ = false;
}

void LayerStore::extend(const Point& point) {
  Point& last = points_.back();
  const bool at_start = points_.size() - 1 == paths_.back().begin;
  if (last.at == point.at) {
    if (!at_start) {
      last.before = std::max(last.before, point.before);
      last.after = std::max(last.after, point.after);
    }
    return;
  }
  const auto widen = [](Range& range, unsigned char code) {
    range = {std::min(range.least, code), std::max(range.most, code)};
  };
  if (may_merge_ && merges(point)) {
    left_out_.push_back(last);
    widen(codes_[0], point.before);
    widen(codes_[1], point.after);
    last = {point.at, codes_[0].most, codes_[1].most};
    return;
  }
  points_.push_back(point);
  left_out_.clear();
  codes_ = {Range{point.before, point.before}, Range{point.after, point.after}};
  may_merge_ = true;
}

// Whether the last stretch and the way to this point can be drawn as one.
bool LayerStore::merges(const Point& point) const {
  const Point& from = points_[points_.size() - 2];
  const auto alike = [this](const Range& range, unsigned char code) {
    const int least = std::max(kSmall, std::min(range.least, code));
    const int most = std::max(kSmall, std::max(range.most, code));
    return most - least <= kAlike + kAlikePerLevel * level_;
  };
  if (length(way(from, point)) > least_ &&
      !(alike(codes_[0], point.before) && alike(codes_[1], point.after))) {
    return false;
  }
  return left_out_.size() < kMostLeftOut && near_chord(from, point);
}

XY LayerStore::way(const Point& from, const Point& to) {
  return map_axes([](std::int32_t a, std::int32_t b) { return static_cast<double>(b - a); },
                  from.at, to.at);
}

bool LayerStore::near_chord(const Point& from, const Point& to) const {
  const XY chord = way(from, to);
  const double length2 = std::max(squared(chord), 1.0);
  const auto is_near = [&](const Point& point) {
    const XY off = way(from, point);
    const double along = std::clamp(dot(off, chord) / length2, 0.0, 1.0);
    return length(off - along * chord) <= tolerance_;
  };
  return is_near(points_.back()) && std::all_of(left_out_.begin(), left_out_.end(), is_near);
}

std::size_t LayerStore::end_of(std::size_t path) const {
  return path + 1 < paths_.size() ? paths_[path + 1].begin : points_.size();
}

std::size_t LayerStore::size_bytes() const {
  return kPointBytes * points_.size() + kPathBytes * paths_.size();
}

// Whether the path is so small that nobody would miss it.
bool LayerStore::too_small(std::span<const Point> path) const {
  return tolerance_ > kCoarsest && std::all_of(path.begin(), path.end(), [&](const Point& point) {
           return length(way(path[0], point)) <= tolerance_;
         });
}

void LayerStore::coarsen() {
  const bool one_layer = paths_.front().layer / layer_step_ == paths_.back().layer / layer_step_;
  if (tolerance_ < kCoarsest || one_layer) {
    ++level_;
    tolerance_ *= 2.0;
    least_ = kLeastPerTolerance * tolerance_;
  } else {
    layer_step_ *= 2;
  }
  const std::vector<Point> points = std::exchange(points_, {});
  const std::vector<Path> paths = std::exchange(paths_, {});
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::size_t end = i + 1 < paths.size() ? paths[i + 1].begin : points.size();
    const std::span<const Point> path(points.data() + paths[i].begin, points.data() + end);
    if (paths[i].layer % layer_step_ != 0 || too_small(path)) {
      continue;
    }
    Path head = paths[i];
    head.begin = points_.size();
    begin_path(head, path.front());
    std::for_each(path.begin() + 1, path.end(), [this](const Point& point) { extend(point); });
  }
  may_merge_ = false;
}

std::array<double, 2> LayerStore::extent(std::size_t axis) const {
  // Places on the axis with path lengths: half of each stretch at each of its ends.
  std::vector<std::pair<std::int32_t, double>> lengths;
  double whole = 0.0;
  for (std::size_t path = 0; path < paths_.size(); ++path) {
    for (std::size_t i = paths_[path].begin + 1; i < end_of(path); ++i) {
      const Point& from = points_[i - 1];
      const Point& to = points_[i];
      const double way_length = length(way(from, to));
      lengths.emplace_back(from.at[axis], 0.5 * way_length);
      lengths.emplace_back(to.at[axis], 0.5 * way_length);
      whole += way_length;
    }
  }
  if (lengths.empty()) {
    return {};
  }
  std::sort(lengths.begin(), lengths.end());
  const auto reached = [&](auto begin, auto end) {
    double passed = 0.0;
    const auto at = std::find_if(begin, end, [&](const auto& each) {
      passed += each.second;
      return passed > kOutside * whole;
    });
    return static_cast<double>(at != end ? at->first : begin->first);
  };
  return {reached(lengths.begin(), lengths.end()), reached(lengths.rbegin(), lengths.rend())};
}

void LayerStore::encode_into(std::size_t layers, std::vector<std::size_t>& ends,
                             std::string& bytes) const {
  ends.assign(layers, 0);
  bytes.clear();
  std::size_t layer = 0;
  Point last;
  std::size_t last_line = 0;
  const auto put_place = [&](const Point& point) {
    for_each_axis(
        [&](std::int32_t to, std::int32_t from) { put_signed(std::int64_t{to} - from, bytes); },
        point.at, last.at);
    last = point;
  };
  for (std::size_t path = 0; path < paths_.size(); ++path) {
    const Path& head = paths_[path];
    for (; layer < head.layer; ++layer) {
      ends[layer] = bytes.size();
      last = Point{};
      last_line = 0;
    }
    put(head.feature, bytes);
    put(end_of(path) - head.begin - 1, bytes);
    put_signed(static_cast<std::int64_t>(head.first_line) - static_cast<std::int64_t>(last_line),
               bytes);
    put(head.last_line - head.first_line, bytes);
    last_line = head.first_line;
    put_place(points_[head.begin]);
    for (std::size_t i = head.begin + 1; i < end_of(path); ++i) {
      put_place(points_[i]);
      bytes += static_cast<char>(points_[i].before);
      bytes += static_cast<char>(points_[i].after);
    }
  }
  for (; layer < layers; ++layer) {
    ends[layer] = bytes.size();
  }
}

report::LayerPaths LayerStore::encode(std::size_t layers, std::vector<std::size_t>& ends) {
  report::LayerPaths result;
  encode_into(layers, ends, result.bytes);
  while (result.bytes.size() > budget_bytes_) {
    coarsen();
    encode_into(layers, ends, result.bytes);
  }
  result.layer_step = layer_step_;
  for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
    const auto [least, most] = extent(axis);
    result.min_mm[axis] = least / kUnitsPerMm;
    result.max_mm[axis] = most / kUnitsPerMm;
  }
  result.tolerance_mm = tolerance_ / kUnitsPerMm;
  return result;
}

}  // namespace unflex::record
