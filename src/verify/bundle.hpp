// Nozzles of different dynamics on one base, which are moved and measured together. They lie in
// lanes (unflex/core/lanes.hpp).
//
// Notation:
//   c   contour error      h   step
#pragma once

#include <cstddef>
#include <vector>

#include "bundle_kernel.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/near_path.hpp"

namespace unflex::verify {

// Figures of all nozzles, by their numbers.
struct BundleSums {
  std::vector<double> contour2_mm2_s;    // ∫ c² dt
  std::vector<double> contour2_max_mm2;  // largest c²
  double weight_s = 0.0;
};

class Bundle {
 public:
  // models: one or more. All nozzles are looked at in steps of the first model's length, or in
  // shorter steps if one of them swings faster.
  explicit Bundle(std::vector<NozzleModel> models);

  [[nodiscard]] std::size_t count() const { return models_.size(); }
  // From now on all frequencies of an axis are this many times those of the models given, but for
  // changes of less than a ten-thousandth. The nozzles' states stay.
  void set_frequencies(const Axes<double>& shares);
  // From now on the nozzles have these models, with the frequencies as given, and rest on a base at
  // rest. There must be at least as many models as nozzles.
  void set_models(const std::vector<NozzleModel>& models, const XY& base_mm);
  // Forgets all nozzles but the first, and their models.
  void keep_first();
  [[nodiscard]] const NozzleModel& model(std::size_t number = 0) const { return models_[number]; }
  // The longest time between two looks.
  [[nodiscard]] double step_s() const;

  [[nodiscard]] NozzleXY nozzle(std::size_t number = 0) const;
  // base_mm: where the base is. It counts where modes do not lie along the axes.
  void set_nozzle(std::size_t number, const NozzleXY& nozzle, const XY& base_mm = {});
  [[nodiscard]] dynamics::NozzleMotionXY motion(std::size_t number) const;
  // States of all nozzles.
  [[nodiscard]] const std::vector<double>& states() const { return arrays_.states; }
  void set_states(const std::vector<double>& states) { arrays_.states = states; }

  // Moves base and nozzles by the same way.
  void shift(const XY& by_mm);
  // Lets the base go on, or stand still, for this time.
  void settle(const dynamics::BaseXY& base, double duration_s);
  // Whether all nozzles go along with a base in even motion.
  [[nodiscard]] bool rest_on(const dynamics::BaseXY& base) const;
  void ride_on(const dynamics::BaseXY& base);

  // Announces `steps` steps of h seconds.
  void begin_steps(double steps, double h);
  // base, z: at the start of the step. z counts where modes move the nozzle in Z.
  void step(const dynamics::BaseXY& base, const dynamics::BaseSegment& z = {});
  // How far the nozzle is above the base, mm. 0 where modes lie along the axes.
  [[nodiscard]] double above_mm(std::size_t number = 0) const;
  [[nodiscard]] bool moves_in_z() const { return has_frames() && models_.front().frame->mode(2); }

  // Measures c of all nozzles at the time of the last slide() of `near`, and since the look before,
  // h seconds ago. h is 0 if the two looks are not connected.
  void look(const ReferencePath& path, NearPath& near, double h);
  // Adds up the figures since the look before. moves: the reference moves; lays: filament is laid.
  void count(bool moves, bool lays);
  // Adds up the last look alone, without weight.
  void count_moment(bool lays);
  // The mean of c² since the look before, and the largest c² since then. Where three looks show a
  // top between them, the largest may be just before. count() may lower the largest.
  [[nodiscard]] double mean_mm2(std::size_t number = 0) const { return arrays_.mean_mm2[number]; }
  [[nodiscard]] double largest_mm2(std::size_t number = 0) const {
    return arrays_.largest_mm2[number];
  }
  // c² at the last look.
  [[nodiscard]] double now_mm2(std::size_t number = 0) const { return arrays_.now_mm2[number]; }
  // The piece of the path that was nearest to the first nozzle at the last look.
  [[nodiscard]] std::size_t nearest() const { return nearest_; }

  // RMS, largest and duration of a nozzle; the other figures are 0.
  [[nodiscard]] Deviation deviation(std::size_t number) const {
    return {stats(extruding_, number), stats(all_, number)};
  }

 private:
  void take_models();
  [[nodiscard]] int rk4_steps_of(double h) const;
  // Whether modes do not lie along the axes (dynamics/mode_frame.hpp). The states in arrays_ are
  // then places and velocities of the nozzles, with the swings y behind them.
  [[nodiscard]] bool has_frames() const { return models_.front().frame.has_value(); }
  [[nodiscard]] NozzleXY swing(std::size_t number) const;
  void set_swing(std::size_t number, const NozzleXY& swing, const dynamics::BaseXY& base);
  // Moves the swings by rk4_steps steps of RK4 while the base goes on for h seconds.
  void step_swings(const dynamics::BaseXY& base, const dynamics::BaseSegment& z, double h,
                   int rk4_steps);
  void make_room();
  // change(axis, value, nozzle) for each axis of each nozzle.
  template <class Change, class Value>
  void change_all(const Change& change, const Axes<Value>& by);
  void add(const std::vector<double>& largest_mm2, double h, BundleSums& sums) const;
  [[nodiscard]] DeviationStats stats(const BundleSums& sums, std::size_t number) const;

  std::vector<NozzleModel> given_;
  Axes<double> shares_{1.0, 1.0};
  std::vector<NozzleModel> models_;  // with shares_ of the frequencies
  const BundleKernel* kernel_;
  double fastest_rad_s_ = 0.0;
  BundleArrays arrays_;
  bool has_maps_ = false;
  double h_ = 0.0;
  int rk4_steps_ = 1;
  std::size_t nearest_ = 0;
  double last_h_ = 0.0;  // h of the last look
  bool last_lays_ = false;
  BundleSums all_;
  BundleSums extruding_;
};

}  // namespace unflex::verify
