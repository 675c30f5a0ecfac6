// The print's paths with their deviations, in bounded memory.
//
// While they fit, every point of the sliced file is kept. When they do not, what is there is drawn
// more coarsely, and what follows as well: first neighbouring stretches become one that has the
// largest deviation of both, then every other layer is left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "unflex/report/recording.hpp"

namespace unflex::record {

// A straight stretch with its deviations (report::deviation_code()).
struct Stretch {
  std::size_t layer = 0;
  std::size_t feature = 0;
  std::size_t line = 0;
  double x0_mm = 0.0, y0_mm = 0.0, x1_mm = 0.0, y1_mm = 0.0;
  unsigned char before = 0, after = 0;
};

class LayerStore {
 public:
  explicit LayerStore(std::size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  // Layers must not decrease.
  void add(const Stretch& stretch);

  // Everything; ends[i] is where layer i ends. Afterwards the store is as before or coarser.
  [[nodiscard]] report::LayerPaths encode(std::size_t layers, std::vector<std::size_t>& ends);

  [[nodiscard]] std::size_t size_bytes() const;

 private:
  struct Point {
    std::int32_t x = 0, y = 0;  // 0.01 mm
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
  [[nodiscard]] bool near_chord(const Point& from, const Point& to) const;
  [[nodiscard]] bool continues(const Stretch& stretch, const Point& start) const;
  [[nodiscard]] std::size_t end_of(std::size_t path) const;
  [[nodiscard]] bool too_small(std::span<const Point> path) const;
  void coarsen();
  // Where all but a few thousandths of the paths' length lies, 0.01 mm.
  [[nodiscard]] std::array<double, 2> extent(std::int32_t Point::*coordinate) const;
  void encode_into(std::size_t layers, std::vector<std::size_t>& ends, std::string& bytes) const;

  std::size_t budget_bytes_;
  int level_ = 0;
  double tolerance_ = 0.5;  // of points left out, 0.01 mm
  double least_ = 0.0;      // stretches shorter than this are merged whatever their deviations
  std::size_t layer_step_ = 1;
  std::vector<Point> points_;
  std::vector<Path> paths_;
  // Of the last stretch: points left out on it, and the deviations of all that it consists of.
  std::vector<Point> left_out_;
  std::array<Range, 2> codes_{};
  bool may_merge_ = false;
};

}  // namespace unflex::record
