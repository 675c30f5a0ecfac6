// The steps and looks of Bundle (bundle.hpp), with nozzles in lanes (unflex/core/lanes.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/verify/near_path.hpp"

namespace unflex::verify {

struct BundleArrays {
  std::size_t places = 0;  // nozzles, in full lanes
  std::size_t modes = 0;   // the most that a nozzle has
  // By axis, mode and nozzle. The gain of a mode that a nozzle lacks is 0.
  std::vector<double> stiffness_per_s2;  // ω²
  std::vector<double> damping_per_s;     // 2ζω
  std::vector<double> gain;
  std::vector<double> lead_s;
  // All positions by axis, mode and nozzle, then all velocities in the same order.
  std::vector<double> states;
  // The states that a step makes of one unit of position, velocity, velocity of the base and
  // acceleration of the base. Each map is in the order of `states`.
  std::array<std::vector<double>, 4> maps;
  // By nozzle.
  std::vector<double> nearest;      // number of the nearest piece of the path
  std::vector<double> now_mm2;      // c² at the last look
  std::vector<double> before_mm2;   // c² at the look before
  std::vector<double> mean_mm2;     // between these two looks
  std::vector<double> largest_mm2;  // between these two looks, or at a top just before
  // At the last look: the way from the path to the nozzle and its rate, x and y of each, and
  // whether the end of a piece was nearest.
  static constexpr std::size_t kIsAtEnd = 4;
  std::array<std::vector<double>, 5> away;
  // The nozzle's place and velocity at the last look.
  std::array<std::vector<double>, 4> was;

  [[nodiscard]] std::size_t place(std::size_t axis, std::size_t mode) const {
    return (axis * modes + mode) * places;
  }
  // The number of positions, which is also the number of velocities.
  [[nodiscard]] std::size_t parts() const { return 2 * modes * places; }
};

class BundleKernel {
 public:
  BundleKernel() = default;
  BundleKernel(const BundleKernel&) = delete;
  BundleKernel& operator=(const BundleKernel&) = delete;
  virtual ~BundleKernel() = default;

  // Finds the maps of a step of h seconds, by rk4_steps steps of RK4.
  virtual void set_maps(double h, int rk4_steps, BundleArrays& at) const = 0;
  // A step of the length that the maps are for.
  virtual void step_by_maps(const dynamics::BaseXY& base, BundleArrays& at) const = 0;
  // A step of h seconds without maps, as rk4_steps steps of RK4.
  virtual void step(const dynamics::BaseXY& base, double h, int rk4_steps,
                    BundleArrays& at) const = 0;
  // Finds c² of the nozzles in their places. If h is not 0, the look before was h seconds ago, and
  // c² is followed from that look. before_h: the time between that look and the one before it, or
  // 0.
  virtual void look(const ReferencePath& path, NearPath& near, double before_h, double h,
                    BundleArrays& at) const = 0;
};

// The kernel that suits the processor's registers.
[[nodiscard]] const BundleKernel& bundle_kernel();

}  // namespace unflex::verify
