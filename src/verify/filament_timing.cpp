#include "filament_timing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::verify {
namespace {

// A place between two passages may be off by so much if it is left out.
constexpr double kSamePlace_mm = 1e-4;

// Adds a passage, and drops the one before it where the speed does not change.
void add(std::vector<Passage>& timing, Passage passage) {
  if (timing.size() >= 2) {
    const Passage& from = timing[timing.size() - 2];
    Passage& last = timing.back();
    const double lasts_s = passage.time_s - from.time_s;
    if (lasts_s > 0.0) {
      const double even_mm = from.covered_mm + (passage.covered_mm - from.covered_mm) *
                                                   (last.time_s - from.time_s) / lasts_s;
      if (std::abs(even_mm - last.covered_mm) < kSamePlace_mm) {
        last = passage;
        return;
      }
    }
  }
  timing.push_back(passage);
}

}  // namespace

void FilamentTiming::begin(double tolerance_mm, double left_behind_mm) {
  tolerance_mm_ = tolerance_mm;
  left_behind_mm_ = left_behind_mm;
  next_sliced_.reset();
  timed_.clear();
  lines_.clear();
  now_ = pulled_ = {};
  sliced_filament_mm_ = 0.0;
  sliced_ended_ = emitted_ended_ = false;
}

bool FilamentTiming::next(ReferenceMove& move) {
  if (timed_.empty()) {
    read_sliced();
    if (!next_sliced_) {
      return false;
    }
    if (const Kind kind = kind_of(*next_sliced_); kind == Kind::travels) {
      time_travel();
    } else {
      time_by_filament(kind);
    }
    forget_lines();
  }
  move = std::move(timed_.front());
  timed_.pop_front();
  return true;
}

// Reads the next sliced move, if it is not known yet.
void FilamentTiming::read_sliced() {
  planner::PlannedMove sliced;
  if (!next_sliced_ && !sliced_ended_) {
    sliced_ended_ = !sliced_source_(sliced);
    if (!sliced_ended_) {
      next_sliced_ = std::move(sliced);
    }
  }
}

FilamentTiming::Kind FilamentTiming::kind_of(const planner::PlannedMove& move) {
  const double filament_mm = move.segment.delta(gcode::E);
  return filament_mm > 0.0 ? Kind::lays : filament_mm < 0.0 ? Kind::draws_back : Kind::travels;
}

// Takes one more line of the emitted file.
bool FilamentTiming::pull() {
  planner::PlannedMove move;
  if (emitted_ended_ || !emitted_source_(move)) {
    emitted_ended_ = true;
    return false;
  }
  lines_.push_back({std::move(move), pulled_.time_s, pulled_.filament_mm, pulled_.length_mm});
  pulled_ = end_of(lines_.back());
  return true;
}

FilamentTiming::Moment FilamentTiming::moment(const Line& line, double share) const {
  const planner::PlannedMove& move = line.move;
  return {line.begin_s + (share < 1.0 ? move.time_s(share * move.length_mm) : move.duration_s()),
          line.filament_mm + share * move.segment.delta(gcode::E),
          line.length_mm + share * move.segment.length_xy_mm()};
}

// One move that lays filament or draws it back.
void FilamentTiming::time_by_filament(Kind kind) {
  ReferenceMove timed{std::move(*std::exchange(next_sliced_, std::nullopt)), {{0.0, 0.0}}};
  const double begin_s = now_.time_s;
  const double sign = kind == Kind::lays ? 1.0 : -1.0;
  const double from_mm = sliced_filament_mm_;
  const double all_mm = std::abs(timed.move.segment.delta(gcode::E));
  sliced_filament_mm_ += timed.move.segment.delta(gcode::E);
  // How much of the move has been passed at a moment.
  const auto share_at = [&](const Moment& at) {
    return std::clamp(sign * (at.filament_mm - from_mm) / all_mm, 0.0, 1.0);
  };
  double reached = share_at(now_);
  const auto is_enough = [&](const Moment& at) {
    return sign * (at.filament_mm - sliced_filament_mm_) >= -tolerance_mm_;
  };
  // Before travel the last filament may be left to the next move that lays some.
  read_sliced();
  const bool is_before_travel = next_sliced_ && kind_of(*next_sliced_) == Kind::travels;
  for (std::size_t i = 0; !is_enough(now_); ++i) {
    if (i == lines_.size() && !pull()) {
      // The file ends too early. The rest is passed as sliced.
      now_ = pulled_;
      now_.time_s += (1.0 - reached) * timed.move.duration_s();
      break;
    }
    const Line& line = lines_[i];
    const Moment end = end_of(line);
    if (end.time_s <= now_.time_s) {
      continue;
    }
    if (is_before_travel && line.move.segment.delta(gcode::E) == 0.0 &&
        (1.0 - reached) * all_mm <= left_behind_mm_) {
      break;
    }
    if (share_at(end) >= 1.0) {
      const double lays_mm = sign * line.move.segment.delta(gcode::E);
      const double needs_mm = sign * (sliced_filament_mm_ - line.filament_mm);
      now_ = lays_mm > 0.0 ? moment(line, std::clamp(needs_mm / lays_mm, 0.0, 1.0)) : end;
      break;
    }
    reached = std::max(reached, share_at(end));
    now_ = end;
    add(timed.timing, {now_.time_s - begin_s, reached * timed.move.length_mm});
  }
  add(timed.timing, {now_.time_s - begin_s, timed.move.length_mm});
  timed_.push_back(std::move(timed));
}

// All moves without filament up to one that has some.
void FilamentTiming::time_travel() {
  double length_mm = 0.0;
  while (next_sliced_ && kind_of(*next_sliced_) == Kind::travels) {
    length_mm += next_sliced_->segment.length_xy_mm();
    timed_.push_back({std::move(*std::exchange(next_sliced_, std::nullopt)), {{0.0, 0.0}}});
    read_sliced();
  }
  // The lines up to the first that lays filament.
  std::vector<Moment> moments = {now_};
  for (std::size_t i = 0;; ++i) {
    if (i == lines_.size() && !pull()) {
      break;
    }
    const Moment end = end_of(lines_[i]);
    if (end.time_s <= now_.time_s) {
      continue;
    }
    if (std::abs(end.filament_mm - now_.filament_mm) > tolerance_mm_ && next_sliced_) {
      break;
    }
    moments.push_back(end);
  }
  const double from_mm = moments.front().length_mm;
  const double base_mm = moments.back().length_mm - from_mm;
  const double lasts_s = moments.back().time_s - moments.front().time_s;
  const auto share_at = [&](const Moment& at) {
    if (base_mm > 0.0) {
      return (at.length_mm - from_mm) / base_mm;
    }
    return lasts_s > 0.0 ? (at.time_s - moments.front().time_s) / lasts_s : 1.0;
  };
  double before_mm = 0.0;
  double begin_s = moments.front().time_s;
  std::size_t next = 1;
  for (ReferenceMove& timed : timed_) {
    const double flat_mm = timed.move.segment.length_xy_mm();
    const double end_share =
        length_mm > 0.0 ? std::min((before_mm + flat_mm) / length_mm, 1.0) : 1.0;
    const auto covered = [&](double share) {
      const double along_mm = share * length_mm - before_mm;
      return flat_mm > 0.0 ? std::clamp(along_mm / flat_mm, 0.0, 1.0) * timed.move.length_mm
                           : timed.move.length_mm;
    };
    const bool is_last = &timed == &timed_.back();
    while (next < moments.size() && (is_last || share_at(moments[next]) < end_share)) {
      add(timed.timing, {moments[next].time_s - begin_s, covered(share_at(moments[next]))});
      ++next;
    }
    double end_s = moments.back().time_s;
    if (!is_last && next < moments.size()) {
      const double a = share_at(moments[next - 1]);
      const double b = share_at(moments[next]);
      const double part = b > a ? std::clamp((end_share - a) / (b - a), 0.0, 1.0) : 1.0;
      end_s = moments[next - 1].time_s + part * (moments[next].time_s - moments[next - 1].time_s);
    }
    end_s = std::max(end_s, begin_s);
    add(timed.timing, {end_s - begin_s, timed.move.length_mm});
    before_mm += flat_mm;
    begin_s = end_s;
  }
  now_ = moments.back();
}

void FilamentTiming::forget_lines() {
  while (!lines_.empty() && end_of(lines_.front()).time_s <= now_.time_s) {
    lines_.pop_front();
  }
}

}  // namespace unflex::verify
