// Writes the parts that all towers share: a square with rounded corners, ring by ring, and the
// codes around it.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "unflex/core/xy.hpp"
#include "unflex/tune/tower.hpp"

namespace unflex::tune {

inline constexpr double kCornerSpeed_mm_s = 30.0;

class TowerWriter {
 public:
  // wall_mm: the least length of a wall without its corners.
  TowerWriter(const TowerPrinter& printer, double wall_mm);

  [[nodiscard]] double layer() const { return 0.5 * printer_->nozzle_diameter_mm; }
  [[nodiscard]] double width() const { return 1.125 * printer_->nozzle_diameter_mm; }
  [[nodiscard]] double filament_per_mm() const { return e_per_mm_; }
  [[nodiscard]] double side_mm() const { return side_mm_; }
  // The text written since the last take().
  [[nodiscard]] std::string take();

  void line(const std::string& text) { text_ += text + "\n"; }
  void extrude(XY to, double speed_mm_s);

  // A point of a corner, which is a quarter of a circle: 2 bottom left, 3 bottom right, 4 or 0 top
  // right, 5 or 1 top left. share: 0 where the ring comes in, 1 where it leaves.
  [[nodiscard]] XY corner(int number, double inset_mm, double share) const;
  // A point `distance_mm` along a wall that begins at `start`, and `inward_mm` off its line. Wall 0
  // is the bottom one, 1 the right one, ….
  [[nodiscard]] static XY on_wall(int wall, XY start, double distance_mm, double inward_mm);

  // Extrudes a wall from the nozzle's place, at the end of the corner ahead of the wall, to the
  // next corner.
  using WallOf = std::function<void(int wall, double inset_mm)>;
  // One ring of the square, drawn in by inset_mm. Its walls are even at this speed.
  void ring(double inset_mm, double speed_mm_s);
  // One ring with walls by `wall`. speed_mm_s is the speed of its corners.
  void ring(double inset_mm, double speed_mm_s, const WallOf& wall);

  struct Bands {
    std::size_t count = 0;
    double corner_speed_mm_s = kCornerSpeed_mm_s;
    WallOf outer_wall;  // of the outer ring
    // Commands ahead of each band, from number 1 on, and of what follows the last one: whole lines.
    std::function<std::string(std::size_t band)> head = {};
    std::string after = {};
  };
  // The whole tower. mark: comments at the tower's begin that tell its trial, in whole lines.
  [[nodiscard]] Tower write(const std::string& mark, const Bands& bands);

 private:
  void travel(XY to);
  void lift(double z_mm);
  void begin_layer(double z_mm);
  // Where the square's ring begins, in the middle of the corner at the bottom left.
  [[nodiscard]] XY begin(double inset_mm) const { return corner(2, inset_mm, 0.5); }
  void arc(int number, double inset_mm, double from, double to, double speed_mm_s);

  const TowerPrinter* printer_;
  double e_per_mm_ = 0.0;
  double side_mm_ = 0.0;
  XY at_;
  std::string text_;
};

inline constexpr const char* kNoTower =
    "is no tower of unflex tune, or has lost its first lines; give the file as it was made";

// The codes and the center that the comments of a tower's file tell. Comments that begin
// with `mark` are passed to `trial` one by one, until it finds fault with one. An error of kind
// input if the file is none.
[[nodiscard]] Result<Codes> codes_in(
    const std::string& text, const std::string& name, std::string_view mark,
    const std::function<Status(std::string_view line, const SourcePlace& place)>& trial);

}  // namespace unflex::tune
