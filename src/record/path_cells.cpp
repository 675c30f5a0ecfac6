#include "path_cells.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::record {
namespace {

constexpr double kCell_mm = 0.5;
constexpr double kMostCells = 2000.0;

}  // namespace

void PathCells::append(const verify::PathPiece& piece, std::size_t layer, std::size_t feature) {
  PathMove move;
  move.extruding = piece.extruding;
  move.line = piece.move.segment.line;
  move.layer = layer;
  move.feature = feature;
  move.start_mm = piece.start_mm;
  move.z_mm = piece.move.segment.end_mm[gcode::Z];
  move.direction = piece.direction;
  move.length_mm = piece.length_xy_mm;
  move.first_cell = first_cell_ + cells_.size();
  if (move.extruding) {
    move.cells =
        static_cast<std::size_t>(std::clamp(std::ceil(move.length_mm / kCell_mm), 1.0, kMostCells));
    cells_.resize(cells_.size() + move.cells);
  }
  moves_.push_back(move);
}

void PathCells::deviate(std::size_t number, int version, double from_mm, double to_mm,
                        unsigned char code) {
  const PathMove& move = moves_[number - first_];
  const double per_mm = static_cast<double>(move.cells) / move.length_mm;
  const auto last = static_cast<double>(move.cells - 1);
  const auto cell_at = [&](double mm) {
    return move.first_cell - first_cell_ +
           static_cast<std::size_t>(std::clamp(std::floor(mm * per_mm), 0.0, last));
  };
  for (std::size_t i = cell_at(from_mm); i <= cell_at(to_mm); ++i) {
    unsigned char& kept = cells_[i][version];
    kept = std::max(kept, code);
  }
}

void PathCells::drop_front() {
  const std::size_t cells = moves_.front().cells;
  cells_.erase(cells_.begin(), cells_.begin() + static_cast<std::ptrdiff_t>(cells));
  first_cell_ += cells;
  moves_.pop_front();
  ++first_;
}

}  // namespace unflex::record
