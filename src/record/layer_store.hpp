// The print's paths with their deviations, in bounded memory.
//
// While the paths fit, every point of the sliced file is kept. When they do not, the paths so far
// and all later ones are drawn more coarsely. First neighbouring stretches are joined to one that
// has the largest deviation of both. Then every other layer is left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "unflex/core/xy.hpp"
#include "unflex/report/recording.hpp"

namespace unflex::record {

// A straight stretch with its deviations (report::deviation_code()).
struct Stretch {
  std::size_t layer = 0;
  std::size_t feature = 0;
  std::size_t line = 0;
  XY from_mm, to_mm;
  unsigned char before = 0, after = 0;
};

class LayerStore {
 public:
  explicit LayerStore(std::size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  // Layers must not decrease.
  void add(const Stretch& stretch);

  // Encodes all paths; layer i ends at byte ends[i]. This may make the store coarser.
  [[nodiscard]] report::LayerPaths encode(std::size_t layers, std::vector<std::size_t>& ends);

  [[nodiscard]] std::size_t size_bytes() const;

 private:
  struct Point {
    Axes<std::int32_t> at;  // 0.01 mm
    unsigned char before = 0, after = 0;
  };
  struct Path {
    std::size_t begin = 0;  // its first point
    std::size_t layer = 0;
    std::size_t feature = 0;
    std::size_t first_line = 0, last_line = 0;
  };
  struct Range {
    unsigned char least = 0, most = 0;
  };

  void begin_path(const Path& head, const Point& start);
  void extend(const Point& point);
  [[nodiscard]] bool merges(const Point& point) const;
  [[nodiscard]] static XY way(const Point& from, const Point& to);  // 0.01 mm
  [[nodiscard]] bool near_chord(const Point& from, const Point& to) const;
  [[nodiscard]] bool continues(const Stretch& stretch, const Point& start) const;
  [[nodiscard]] std::size_t end_of(std::size_t path) const;
  [[nodiscard]] bool too_small(std::span<const Point> path) const;
  void coarsen();
  // Range of the axis in which all but a few thousandths of the paths' length lies, 0.01 mm.
  [[nodiscard]] std::array<double, 2> extent(std::size_t axis) const;
  void encode_into(std::size_t layers, std::vector<std::size_t>& ends, std::string& bytes) const;

  std::size_t budget_bytes_;
  int level_ = 0;
  double tolerance_ = 0.5;  // how far left-out points may lie from what is drawn, 0.01 mm
  double least_ = 0.0;      // shorter stretches are merged whatever their deviations, 0.01 mm
  std::size_t layer_step_ = 1;
  std::vector<Point> points_;
  std::vector<Path> paths_;
  // Points left out on the last stretch, and the range of deviations on it.
  std::vector<Point> left_out_;
  std::array<Range, 2> codes_{};
  bool may_merge_ = false;
};

}  // namespace unflex::record
