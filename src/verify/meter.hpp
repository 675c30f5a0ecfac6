// Hangs the nozzle on a base that is moved, and measures it against the reference.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "bundle.hpp"
#include "filament_lag.hpp"
#include "lag_estimate.hpp"
#include "laid_line.hpp"
#include "path_corners.hpp"
#include "place_gauge.hpp"
#include "reference_phase.hpp"
#include "shaped_base.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/machine_change.hpp"
#include "unflex/verify/near_path.hpp"
#include "unflex/verify/observer.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

// How fast the nozzle goes relative to F.
class FeedGauge {
 public:
  // v2: the square of the nozzle's speed.
  void add(double v2_mm2_s2, double feed_mm_s, double weight_s, std::size_t line) {
    const double ratio2 = v2_mm2_s2 / (feed_mm_s * feed_mm_s);
    ratio_s_.add_square(ratio2, weight_s);
    if (ratio2 > ratio2_max_) {
      ratio2_max_ = ratio2;
      line_ = line;
    }
  }
  [[nodiscard]] FeedStats stats() const {
    const double max = std::sqrt(ratio2_max_);
    return {std::min(max, ratio_s_.quantile(0.999)), max, line_};
  }

 private:
  LogHistogram ratio_s_;  // time per cell
  double ratio2_max_ = 0.0;
  std::size_t line_ = 0;
};

// How far the nozzle is above or below its plan.
class HeightGauge {
 public:
  void add(double above_mm, double weight_s) {
    sum_mm2_s_ += above_mm * above_mm * weight_s;
    weight_s_ += weight_s;
    max_mm_ = std::max(max_mm_, std::abs(above_mm));
  }
  [[nodiscard]] HeightStats stats() const {
    return {max_mm_, weight_s_ > 0.0 ? std::sqrt(sum_mm2_s_ / weight_s_) : 0.0};
  }

 private:
  double sum_mm2_s_ = 0.0;
  double weight_s_ = 0.0;
  double max_mm_ = 0.0;
};

// The contour error of a nozzle in one section.
class SectionError {
 public:
  void add(double contour2_mm2, double contour2_max_mm2, double weight_s, std::size_t line) {
    sum_contour2_ += weight_s * contour2_mm2;
    weight_s_ += weight_s;
    if (contour2_max_mm2 > contour2_max_) {
      contour2_max_ = contour2_max_mm2;
      line_ = line;
    }
  }
  [[nodiscard]] double max_mm() const { return std::sqrt(contour2_max_); }
  [[nodiscard]] double rms_mm() const {
    return weight_s_ > 0.0 ? std::sqrt(sum_contour2_ / weight_s_) : 0.0;
  }
  [[nodiscard]] double duration_s() const { return weight_s_; }
  [[nodiscard]] std::size_t line() const { return line_; }  // line of the largest error

 private:
  double sum_contour2_ = 0.0;
  double weight_s_ = 0.0;
  double contour2_max_ = 0.0;
  std::size_t line_ = 0;
};

// Moves a bundle of nozzles. The first is measured in every way, the others by their contour errors
// alone.
class Meter {
 public:
  // least_reach_s: of reach_s(), for models that come later.
  explicit Meter(const NozzleModel& model, const std::vector<NozzleModel>& others = {},
                 double least_reach_s = 0.0);

  // Tells the observer of every step of each nozzle.
  void watch(Observer* observer, NozzleBase base);
  // Keeps the first nozzle alone from now on.
  void drop_others();
  // Hangs up other nozzles, at rest: Bundle::set_models().
  void set_models(const std::vector<NozzleModel>& models);
  // From now on the frequencies are those of a machine that is at this place. Over the bed they
  // follow the base. `change` must outlive the meter.
  void set_machine(const MachineChange& change, const gcode::Position& at);
  // How many others there are, and how far they stray.
  [[nodiscard]] std::size_t others() const { return bundle_.count() - 1; }
  [[nodiscard]] Deviation deviation_of_other(std::size_t number) const {
    return bundle_.deviation(number + 1);
  }

  // The first nozzle and the base at the very start.
  void set_state(const NozzleXY& nozzle, const XY& base_mm);
  // Measures against this path from now on. The path must live as long. The clock is set to
  // unplayed_s before the start of the path's current section. unplayed_mm: filament that is still
  // to come before the section begins, counted as in BasePhase::e.
  void begin_section(ReferencePath& path, double unplayed_s = 0.0, double unplayed_mm = 0.0);
  // Moves the base. If it does not start where the base stands, base and nozzle are shifted there.
  void play(const planner::PlannedMove& move) { play(move, move); }
  // Plays a move whose filament comes out otherwise than it is pushed.
  void play(const planner::PlannedMove& laid, const planner::PlannedMove& pushed);
  // Moves the base by a phase that begins where the base stands.
  void play(BasePhase phase);
  // Filament that phases have counted becomes filament laid; they will count from 0 again.
  void add_filament(double filament_mm) { laid_mm_ += filament_mm; }
  // Moves the base by a phase while nothing is measured and the clock stands.
  void settle(const BasePhase& phase);
  // Shifts base and nozzle, so that the base is at this place.
  void shift_to(const XY& place_mm);
  // Measures the present moment with weight zero, so that it counts for the largest errors.
  void look();
  // The base stands still until the reference has ended, and the nozzle is measured meanwhile. Then
  // the nozzle's state and the clock are reset, since the machine does not wait.
  void wait_for_reference();
  // The base stands still; nothing is measured.
  void hold(double duration_s);
  // Puts the clock forward, within a section.
  void skip(double duration_s) {
    time_s_ += duration_s;
    last_look_.reset();
  }

  // Also measures the filament's lag.
  void follow_filament() { follows_filament_ = true; }
  [[nodiscard]] LagStats filament_lag() const { return filament_lag_.stats(); }

  // Also measures the line of plastic.
  void follow_line(const LineModel& model);
  void drop_line() { line_.reset(); }
  // nullptr if it is not followed.
  [[nodiscard]] LaidLine* line() { return line_ ? &*line_ : nullptr; }

  // Also measures how far the nozzle passes from corners.
  void follow_corners() { corners_.emplace(near_.reach_s()); }
  [[nodiscard]] CornerStats corners() const { return corners_ ? corners_->stats() : CornerStats{}; }

  // Also measures how fast the nozzle goes relative to F.
  void follow_feed(bool on) { follow_feed_ = on; }
  [[nodiscard]] FeedStats feed() const { return feed_.stats(); }

  void follow_lag(bool on);
  [[nodiscard]] double worst_lag_s() const { return lag_.worst_s(); }
  [[nodiscard]] double lag_s() const { return lag_.present_s(); }

  [[nodiscard]] double time_s() const { return time_s_; }
  // nullopt where modes do not move the nozzle in Z.
  [[nodiscard]] std::optional<HeightStats> height() const {
    return bundle_.moves_in_z() ? std::optional(height_.stats()) : std::nullopt;
  }
  // nullopt while set_machine() was not called.
  [[nodiscard]] std::optional<PlaceErrors> places() const {
    return places_ ? std::optional(places_->errors()) : std::nullopt;
  }
  [[nodiscard]] NozzleXY nozzle() const { return bundle_.nozzle(); }
  [[nodiscard]] const XY& base_mm() const { return base_mm_; }
  [[nodiscard]] const DeviationAccumulator& extruding() const { return extruding_; }
  [[nodiscard]] const DeviationAccumulator& all() const { return all_; }
  [[nodiscard]] double reach_s() const { return near_.reach_s(); }
  // Contour error while filament is laid, in the section that began last.
  [[nodiscard]] const SectionError& section_error() const { return section_error_; }
  // Distance of the base from the path that the reference passes within ±reach_s() of now.
  [[nodiscard]] double base_offset_mm();
  // Distance from a place to the end of the path known so far.
  [[nodiscard]] double to_path_end_mm(const gcode::Position& from) const;
  // How far the nozzle will swing from the end of the path known so far.
  [[nodiscard]] double swing_mm() const;

 private:
  void integrate(BasePhase& phase, double duration_s, bool measured);
  void step(BasePhase& phase, double h, bool rides);
  [[nodiscard]] double next_reference_change();
  void count_filament(const BasePhase& phase, const dynamics::BaseSegment& pushed_from,
                      const ReferencePhase& reference, const dynamics::NozzleMotionXY& nozzle,
                      bool measured, double h);
  // A look at the first nozzle.
  struct Sample {
    double tracking2_mm2 = 0.0;
    std::size_t line = 0;
  };
  // nozzle: the first one. since_s: the time since the last look; 0 if this one does not continue
  // it.
  [[nodiscard]] Sample look(const ReferencePhase& reference, const dynamics::NozzleMotionXY& nozzle,
                            double since_s);
  [[nodiscard]] Sample look_at_rest(const dynamics::NozzleMotionXY& nozzle, double since_s);
  void count(const Sample& from, const Sample& to, const ReferencePhase& reference,
             const dynamics::NozzleMotionXY& nozzle, bool measured, bool laying, double h);
  [[nodiscard]] std::optional<PathPlace> place(bool measured, const ReferencePhase& reference,
                                               const dynamics::NozzleMotionXY& nozzle) const;
  void tell(const BasePhase& phase, double h, bool measured, const ReferencePhase& reference,
            const Sample& sample);

  std::vector<BasePhase> phases_;  // phases of the move at hand
  ReferencePath* path_ = nullptr;
  double time_s_ = 0.0;
  Bundle bundle_;
  // The last look, if the next step begins with it.
  std::optional<Sample> last_look_;
  bool last_measured_ = false;
  XY base_mm_;
  HeightGauge height_;
  std::optional<PlaceGauge> places_;
  const MachineChange* over_bed_ = nullptr;  // set while frequencies change over the bed
  gcode::Position machine_at_mm_{};          // where they are those of bundle_
  std::size_t current_ = 0;                  // piece of the reference at time_s_
  NearPath near_;
  DeviationAccumulator extruding_;
  DeviationAccumulator all_;
  SectionError section_error_;
  FilamentLag filament_lag_;
  bool follows_filament_ = false;
  // Filament laid before the move or the shaped motion at hand, counted as in
  // ReferencePath::filament_mm().
  double laid_mm_ = 0.0;
  std::optional<LaidLine> line_;
  std::optional<PathCorners> corners_;
  FeedGauge feed_;
  bool follow_feed_ = false;
  LagEstimate lag_;
  bool follow_lag_ = false;
  bool waiting_ = false;
  Observer* observer_ = nullptr;
  NozzleBase base_ = NozzleBase::sliced;
};

}  // namespace unflex::verify
