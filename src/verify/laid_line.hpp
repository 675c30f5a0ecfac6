// How wide the line of plastic is, and where its edges are.
//
// Notation:
//   e(t)      filament of the moves in X and Y that are played, mm
//   E(t)      filament that the extruder pushes: e + K ė with the firmware's pressure advance,
//             both smoothed by a triangle of 2W (Klipper: chelper/kin_extruder.c; W = half of
//             pressure_advance_smooth_time; 0: not smoothed)
//   V(t)      filament that has come out by then (PressedFilament)
//   s(t)      where on its line the nozzle is
//   bin       0.4 mm of a line of the sliced file. A line is the way in X and Y between two places
//             where nothing is laid; its first and last millimetre have no bins, but are measured
//             as a whole
//   w         width error of a bin: filament that comes out while s is in it, over what the sliced
//             file asks there, minus one
//   edge      |contour error| + |w|/2 · width of a line, mm: how far one edge of the line may
//             be off
//
// Retractions are left out, by moves of filament alone and by wipes: what they do to the pressure,
// the next one undoes. Only where pressure is written into the filament, wipes count. E(t), V(t)
// and s(t) are kept on a grid of cells in time. What comes out in a cell is spread evenly over the
// way that the nozzle makes in it.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "nozzle_place.hpp"
#include "pressed_filament.hpp"
#include "unflex/planner/printer_shaper.hpp"
#include "unflex/verify/line_model.hpp"
#include "unflex/verify/log_histogram.hpp"
#include "unflex/verify/observer.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

class LaidLine {
 public:
  explicit LaidLine(const LineModel& model);

  // Sets the hotend that the file is printed with from now on. With an advance of 0 the hotend is
  // not known, and nothing is measured.
  void set(const dynamics::HotendPressure& hotend, const planner::FirmwareAdvance& advance);
  // Tells the observer each bin under this nozzle's id. Null: nobody is told.
  void watch(Observer* observer, NozzleId nozzle) {
    observer_ = observer;
    nozzle_ = nozzle;
  }
  // Whether the hotend is known.
  [[nodiscard]] bool is_measuring() const { return hotend_.advance_s > 0.0; }
  // Measures against this path from now on, beginning with its current section.
  void begin_section(const ReferencePath& path);

  struct Step {
    double duration_s = 0.0;
    double pushed_mm = 0.0;       // change of e
    double from_mm_s = 0.0;       // ė at its begin
    double to_mm_s = 0.0;         // and at its end
    bool is_advanced = false;     // pressure advance acts on it
    double contour2_mm2 = 0.0;    // square of the contour error
    std::optional<PathPlace> at;  // where the nozzle is at its end; nullopt: on no line
  };
  void add(const ReferencePath& path, const Step& step);
  // The machine stands still, the nozzle off its line.
  void rest(double duration_s);
  // Nothing follows.
  void finish();

  // The figures of all complete lines.
  [[nodiscard]] LineStats stats() const;

 private:
  // Hotends that are simulated side by side: LineStats::width, and LineStats::other.
  static constexpr std::size_t kHotends = 1 + kOtherHotends;
  using PerHotend = std::array<double, kHotends>;

  // A place on a line of plastic.
  struct Place {
    std::size_t line = 0;  // number, from 1 on; 0: none
    double along_mm = 0.0;
  };
  struct Cell {
    double pushed_mm = 0.0;  // of E, once all that is smoothed into it is known
    double contour2_mm2 = 0.0;
    Place from;
    Place to;
  };
  struct Bin {
    double wanted_mm = 0.0;
    PerHotend laid_mm{};
    double contour2_mm2_s = 0.0;
    double duration_s = 0.0;
    std::size_t line = 0;  // of the sliced file
  };
  struct Line {
    std::size_t number = 0;
    double length_mm = 0.0;  // as far as it is known
    bool is_complete = false;
    Bin first;                  // its first millimetre
    std::size_t first_bin = 0;  // number of the first that is kept
    std::deque<Bin> bins;
  };
  struct Widths {
    LogHistogram error;
    double sum2 = 0.0;
    double largest = 0.0;
    double wide = 0.0;
    std::size_t line = 0;
    void add(double width_error, std::size_t at_line);
    [[nodiscard]] WidthStats stats(double count) const;
  };

  // One end of the lines.
  struct Ends {
    double sum = 0.0;
    double sum2 = 0.0;
    void add(double error);
    [[nodiscard]] EndStats stats(double count) const;
  };

  struct LineEnds {
    Ends first;
    Ends last;
    double lines = 0.0;  // how many have been measured
  };

  struct Edges {
    LogHistogram error_mm;
    double sum2 = 0.0;
    double largest_mm = 0.0;
    std::size_t line = 0;
  };

  void take_pieces(const ReferencePath& path);
  void end_line();
  void extend(Line& line, const PathPiece& piece);
  [[nodiscard]] Place place_on_line(const PathPlace& place) const;
  void fill(double duration_s, double pushed_mm, double from_mm_s, double to_mm_s, bool is_advanced,
            double contour2_mm2, const Place& from, const Place& to);
  void close_cell(const Place& at);
  void spread(double pushed_mm);
  void lay(const Cell& cell);
  void deposit(const Place& from, const Place& to, const PerHotend& out_mm, double contour2_mm2);
  void end_lines_before(std::size_t number);
  void measure(Line& line, double until_mm);
  void count(const Bin& bin);
  void measure_ends(const Line& line);
  [[nodiscard]] static double width_error(const Bin& bin) {
    return bin.laid_mm[0] / bin.wanted_mm - 1.0;
  }

  LineModel model_;
  Observer* observer_ = nullptr;
  NozzleId nozzle_;
  dynamics::HotendPressure hotend_;
  planner::FirmwareAdvance advance_;
  std::array<PressedFilament, kHotends> pressed_;

  const ReferencePath* path_ = nullptr;
  std::size_t next_piece_ = 0;   // first piece that has not been taken
  std::size_t first_piece_ = 0;  // piece of starts_.front()
  std::deque<Place> starts_;     // where the pieces taken begin
  std::size_t section_ = 0;      // of the last piece taken
  std::size_t lines_ = 0;        // number of the last line
  bool line_is_open_ = false;
  std::deque<Line> open_;  // lines that are not yet measured to their end

  // The cell being filled.
  double filled_s_ = 0.0;
  Cell cell_;
  double advanced_mm_ = 0.0;   // K ė where the last cell ended
  double sum_contour2_ = 0.0;  // ∫ over the cell
  Place at_;                   // where the last step ended
  std::deque<Cell>
      cells_;  // the last ones, as many as smoothing reaches ahead, which may still get filament
  std::deque<double> later_mm_;  // what the cells to come get from those before

  Widths width_;
  std::array<Widths, kOtherHotends> other_;
  Edges edges_;
  double bins_ = 0.0;
  LineEnds ends_;
};

}  // namespace unflex::verify
