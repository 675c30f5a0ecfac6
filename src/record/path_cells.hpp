// Moves of the sliced file that one of the two nozzles has reached and not both have left. Each
// move is cut into cells, and each cell keeps its largest deviations before and after.
#pragma once

#include <array>
#include <cstddef>
#include <deque>

#include "unflex/core/xy.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::record {

struct PathMove {
  bool extruding = false;
  std::size_t line = 0;
  std::size_t layer = 0;
  std::size_t feature = 0;
  XY start_mm;
  double z_mm = 0.0;  // at the end
  XY direction;
  double length_mm = 0.0;
  std::size_t first_cell = 0;
  std::size_t cells = 0;

  // How far along the move a point is.
  [[nodiscard]] double along_mm(const XY& place_mm) const {
    return dot(place_mm - start_mm, direction);
  }
};

// Moves have numbers that go up by one and stay the same.
class PathCells {
 public:
  [[nodiscard]] std::size_t first() const { return first_; }
  [[nodiscard]] std::size_t end() const { return first_ + moves_.size(); }
  [[nodiscard]] const PathMove& operator[](std::size_t number) const {
    return moves_[number - first_];
  }

  void append(const verify::PathPiece& piece, std::size_t layer, std::size_t feature);
  // Notes a deviation between two distances along the move. Version 0 is before, 1 after.
  void deviate(std::size_t number, int version, double from_mm, double to_mm, unsigned char code);
  [[nodiscard]] std::array<unsigned char, 2> cell(const PathMove& move, std::size_t i) const {
    return cells_[move.first_cell - first_cell_ + i];
  }
  void drop_front();
  // Only while there are no moves: the next one appended gets this number.
  void continue_at(std::size_t number) { first_ = number; }

 private:
  std::deque<PathMove> moves_;
  std::deque<std::array<unsigned char, 2>> cells_;
  std::size_t first_ = 0;
  std::size_t first_cell_ = 0;
};

}  // namespace unflex::record
