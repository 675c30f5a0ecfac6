#include "laid_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace unflex::verify {
namespace {

constexpr double kCell_s = 5e-4;
constexpr double kEnd_mm = 1.0;  // of a line, without bins
// The nozzle does not go back on its line by more than this.
constexpr double kBack_mm = 10.0;
constexpr double kWide = 0.1;
constexpr double kRounding_mm = 1e-9;

constexpr std::array<double, kOtherHotends> kTimesAdvance = {0.8, 1.2, 1.0, 1.0};
constexpr std::array<double, kOtherHotends> kLater_s = {0.0, 0.0, -2e-3, 2e-3};

std::size_t cells(double duration_s) {
  return static_cast<std::size_t>(std::lround(duration_s / kCell_s));
}

// The number of cells that the firmware may smooth ahead: Klipper takes a smooth time of 0.2 s at
// most.
constexpr std::size_t kLatency = 200;

double begin_of_bin_mm(std::size_t number) {
  return kEnd_mm + kWidthBin_mm * static_cast<double>(number);
}

std::size_t bin_at(double along_mm) {
  return static_cast<std::size_t>(std::max(along_mm - kEnd_mm, 0.0) / kWidthBin_mm);
}

// How much of [a, b] lies in the bin.
double overlap_mm(std::size_t bin, double a_mm, double b_mm) {
  const double begin = begin_of_bin_mm(bin);
  return std::max(std::min(b_mm, begin + kWidthBin_mm) - std::max(a_mm, begin), 0.0);
}

// How much of [a, b] lies in the first millimetre.
double of_first_mm(double a_mm, double b_mm) {
  return std::max(std::min(b_mm, kEnd_mm) - a_mm, 0.0);
}

}  // namespace

LaidLine::LaidLine(const LineModel& model) : model_(model) {
  later_mm_.assign(kLatency + 1, 0.0);
  set(model.hotend, {});
}

void LaidLine::set(const dynamics::HotendPressure& hotend,
                   const planner::FirmwareAdvance& advance) {
  hotend_ = hotend;
  advance_ = advance;
  pressed_[0].set(hotend);
  for (std::size_t i = 0; i < kOtherHotends; ++i) {
    dynamics::HotendPressure other = hotend.scaled(kTimesAdvance[i]);
    other.dead_time_s = std::max(hotend.dead_time_s + kLater_s[i], 0.0);
    pressed_[1 + i].set(other);
  }
}

void LaidLine::begin_section(const ReferencePath& path) {
  if (path_ == &path) {
    return;
  }
  end_line();
  path_ = &path;
  next_piece_ = path.end();
  while (next_piece_ > path.first() && path[next_piece_ - 1].section == path.section()) {
    --next_piece_;
  }
  first_piece_ = next_piece_;
  starts_.clear();
}

void LaidLine::take_pieces(const ReferencePath& path) {
  for (; next_piece_ < path.end(); ++next_piece_) {
    if (next_piece_ < path.first()) {
      // The place was dropped before the nozzle came near.
      starts_.push_back({});
      end_line();
      continue;
    }
    const PathPiece& piece = path[next_piece_];
    const bool is_laid = piece.extruding && piece.length_xy_mm > 0.0 && is_measuring();
    if (!is_laid || piece.section != section_) {
      end_line();
    }
    section_ = piece.section;
    if (!is_laid) {
      starts_.push_back({});
      continue;
    }
    if (!line_is_open_) {
      open_.emplace_back().number = ++lines_;
      line_is_open_ = true;
    }
    starts_.push_back({lines_, open_.back().length_mm});
    extend(open_.back(), piece);
  }
  while (first_piece_ < std::min(path.first(), next_piece_)) {
    starts_.pop_front();
    ++first_piece_;
  }
}

void LaidLine::end_line() {
  if (line_is_open_) {
    open_.back().is_complete = true;
  }
  line_is_open_ = false;
}

void LaidLine::extend(Line& line, const PathPiece& piece) {
  const double from_mm = line.length_mm;
  line.length_mm += piece.length_xy_mm;
  const double per_mm = piece.move.segment.delta(gcode::E) / piece.length_xy_mm;
  line.first.wanted_mm += per_mm * of_first_mm(from_mm, line.length_mm);
  for (std::size_t number = bin_at(from_mm); begin_of_bin_mm(number) < line.length_mm; ++number) {
    if (number < line.first_bin) {
      continue;
    }
    while (line.first_bin + line.bins.size() <= number) {
      line.bins.emplace_back();
    }
    Bin& bin = line.bins[number - line.first_bin];
    bin.wanted_mm += per_mm * overlap_mm(number, from_mm, line.length_mm);
    bin.line = piece.move.segment.line;
  }
}

LaidLine::Place LaidLine::place_on_line(const PathPlace& place) const {
  if (place.piece < first_piece_ || place.piece - first_piece_ >= starts_.size()) {
    return {};
  }
  Place at = starts_[place.piece - first_piece_];
  at.along_mm += place.along_mm;
  return at;
}

void LaidLine::add(const ReferencePath& path, const Step& step) {
  take_pieces(path);
  const Place to = step.at ? place_on_line(*step.at) : Place{};
  fill(step.duration_s, step.pushed_mm, step.from_mm_s, step.to_mm_s, step.is_advanced,
       step.contour2_mm2, at_, to);
}

void LaidLine::rest(double duration_s) {
  fill(std::max(duration_s, 0.0), 0.0, 0.0, 0.0, false, 0.0, {}, {});
}

// Puts a step of even acceleration into cells.
void LaidLine::fill(double duration_s, double pushed_mm, double from_mm_s, double to_mm_s,
                    bool is_advanced, double contour2_mm2, const Place& from, const Place& to) {
  const double accel = duration_s > 0.0 ? (to_mm_s - from_mm_s) / duration_s : 0.0;
  double done_s = 0.0;
  double done_mm = 0.0;
  while (kCell_s - filled_s_ <= duration_s - done_s) {
    const double part_s = kCell_s - filled_s_;
    done_s += part_s;
    const double until_mm = duration_s > 0.0 ? pushed_mm * done_s / duration_s +
                                                   0.5 * accel * done_s * (done_s - duration_s)
                                             : pushed_mm;
    cell_.pushed_mm += until_mm - done_mm;
    done_mm = until_mm;
    sum_contour2_ += part_s * contour2_mm2;
    const double share = duration_s > 0.0 ? done_s / duration_s : 1.0;
    Place at = to;
    if (from.line == to.line) {
      at.along_mm = from.along_mm + share * (to.along_mm - from.along_mm);
    }
    const double advanced_mm =
        is_advanced ? advance_.advance_s * (from_mm_s + accel * done_s) : 0.0;
    cell_.pushed_mm += advanced_mm - advanced_mm_;
    advanced_mm_ = advanced_mm;
    close_cell(at);
  }
  cell_.pushed_mm += pushed_mm - done_mm;
  sum_contour2_ += (duration_s - done_s) * contour2_mm2;
  filled_s_ += duration_s - done_s;
  at_ = to;
}

void LaidLine::close_cell(const Place& at) {
  const double pushed_mm = cell_.pushed_mm;
  cell_.pushed_mm = later_mm_.front();
  later_mm_.pop_front();
  later_mm_.push_back(0.0);
  cell_.contour2_mm2 = sum_contour2_ / kCell_s;
  cell_.to = at;
  cells_.push_back(cell_);
  spread(pushed_mm);
  cell_ = {};
  cell_.from = at;
  sum_contour2_ = 0.0;
  filled_s_ = 0.0;
  if (cells_.size() > kLatency) {
    lay(cells_.front());
    cells_.pop_front();
  }
}

// Smooths what was pushed in the last cell.
void LaidLine::spread(double pushed_mm) {
  const std::size_t half = std::min(cells(0.5 * advance_.smooth_s), kLatency);
  if (half <= 1) {
    cells_.back().pushed_mm += pushed_mm;
    return;
  }
  const auto width = static_cast<double>(half);
  for (std::size_t away = 0; away < half; ++away) {
    const double part_mm = pushed_mm * (width - static_cast<double>(away)) / (width * width);
    // At the very beginning there are too few cells. The first one takes what belongs before it.
    cells_[cells_.size() - 1 - std::min(away, cells_.size() - 1)].pushed_mm += part_mm;
    if (away > 0) {
      later_mm_[away - 1] += part_mm;
    }
  }
}

void LaidLine::lay(const Cell& cell) {
  PerHotend out_mm{};
  for (std::size_t i = 0; i < kHotends; ++i) {
    out_mm[i] = pressed_[i].push(kCell_s, cell.pushed_mm);
  }
  const Place& at = cell.to.line != 0 ? cell.to : cell.from;
  if (at.line == 0 || open_.empty() || at.line < open_.front().number) {
    return;
  }
  end_lines_before(at.line);
  deposit(cell.from.line == at.line ? cell.from : at, at, out_mm, cell.contour2_mm2);
}

void LaidLine::deposit(const Place& from, const Place& to, const PerHotend& out_mm,
                       double contour2_mm2) {
  Line& line = open_[to.line - open_.front().number];
  const double a_mm = std::min(from.along_mm, to.along_mm);
  const double b_mm = std::max({from.along_mm, to.along_mm, a_mm + kRounding_mm});
  line.first.laid_mm[0] += of_first_mm(a_mm, b_mm) / (b_mm - a_mm) * out_mm[0];
  for (std::size_t number = std::max(bin_at(a_mm), line.first_bin);
       begin_of_bin_mm(number) < b_mm && number - line.first_bin < line.bins.size(); ++number) {
    const double share = overlap_mm(number, a_mm, b_mm) / (b_mm - a_mm);
    Bin& bin = line.bins[number - line.first_bin];
    for (std::size_t i = 0; i < kHotends; ++i) {
      bin.laid_mm[i] += share * out_mm[i];
    }
    bin.contour2_mm2_s += share * kCell_s * contour2_mm2;
    bin.duration_s += share * kCell_s;
  }
  measure(line, a_mm - kBack_mm);
}

void LaidLine::end_lines_before(std::size_t number) {
  while (!open_.empty() && open_.front().number < number) {
    measure(open_.front(), open_.front().length_mm);
    measure_ends(open_.front());
    open_.pop_front();
  }
}

// The bins that are left are those of the last millimetre.
void LaidLine::measure_ends(const Line& line) {
  constexpr double kShortest_mm = 3.0;
  Bin last;
  for (const Bin& bin : line.bins) {
    last.wanted_mm += bin.wanted_mm;
    last.laid_mm[0] += bin.laid_mm[0];
  }
  if (line.length_mm >= kShortest_mm && line.first.wanted_mm > 0.0 && last.wanted_mm > 0.0) {
    ends_.lines += 1.0;
    ends_.first.add(width_error(line.first));
    ends_.last.add(width_error(last));
  }
}

// Counts the bins that end before this place, and not within the end of the line.
void LaidLine::measure(Line& line, double until_mm) {
  const double last_mm = std::min(until_mm, line.length_mm - kEnd_mm) + kRounding_mm;
  while (!line.bins.empty() && begin_of_bin_mm(line.first_bin + 1) <= last_mm) {
    const Bin& bin = line.bins.front();
    count(bin);
    if (observer_ != nullptr) {
      observer_->width(nozzle_, {line.number, width_error(bin)});
    }
    line.bins.pop_front();
    ++line.first_bin;
  }
}

void LaidLine::count(const Bin& bin) {
  bins_ += 1.0;
  const double error = width_error(bin);
  width_.add(error, bin.line);
  for (std::size_t i = 0; i < kOtherHotends; ++i) {
    other_[i].add(bin.laid_mm[1 + i] / bin.wanted_mm - 1.0, bin.line);
  }
  const double contour_mm =
      bin.duration_s > 0.0 ? std::sqrt(bin.contour2_mm2_s / bin.duration_s) : 0.0;
  const double edge_mm = contour_mm + 0.5 * std::abs(error) * model_.width_mm;
  edges_.error_mm.add_square(edge_mm * edge_mm, 1.0);
  edges_.sum2 += edge_mm * edge_mm;
  if (edge_mm > edges_.largest_mm) {
    edges_.largest_mm = edge_mm;
    edges_.line = bin.line;
  }
}

void LaidLine::finish() {
  end_line();
  // A cell is laid once kLatency later ones are full. This rest fills them, so that all are laid.
  rest(kCell_s * static_cast<double>(kLatency + 1));
  end_lines_before(lines_ + 1);
}

void LaidLine::Widths::add(double width_error, std::size_t at_line) {
  error.add_square(width_error * width_error, 1.0);
  sum2 += width_error * width_error;
  wide += std::abs(width_error) > kWide ? 1.0 : 0.0;
  if (std::abs(width_error) > std::abs(largest)) {
    largest = width_error;
    line = at_line;
  }
}

void LaidLine::Ends::add(double error) {
  sum += error;
  sum2 += error * error;
}

EndStats LaidLine::Ends::stats(double count) const {
  return count > 0.0 ? EndStats{std::sqrt(sum2 / count), sum / count} : EndStats{};
}

WidthStats LaidLine::Widths::stats(double count) const {
  if (count == 0.0) {
    return {};
  }
  return {std::sqrt(sum2 / count), std::min(error.quantile(0.99), std::abs(largest)), largest,
          wide / count, line};
}

LineStats LaidLine::stats() const {
  LineStats result;
  result.length_mm = kWidthBin_mm * bins_;
  result.width = width_.stats(bins_);
  for (std::size_t i = 0; i < kOtherHotends; ++i) {
    result.other[i] = other_[i].stats(bins_);
  }
  result.first = ends_.first.stats(ends_.lines);
  result.last = ends_.last.stats(ends_.lines);
  if (bins_ > 0.0) {
    result.edge = {std::sqrt(edges_.sum2 / bins_),
                   std::min(edges_.error_mm.quantile(0.99), edges_.largest_mm), edges_.largest_mm,
                   edges_.line};
  }
  return result;
}

}  // namespace unflex::verify
