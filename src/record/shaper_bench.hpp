// How the firmware's input shapers would have done on the same print. Each is built for the
// frequencies of the settings and measured on machines whose true frequencies are as set or
// somewhat off. The printer's own shaper, built for its own frequencies, is measured beside them.
//
// A whole print has too many moments to measure all. So after some time only every second, then
// every fourth second is measured (and so on), and counts 2, 4, … times.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "unflex/record/recorder.hpp"
#include "unflex/report/recording.hpp"
#include "unflex/rivals/shaped_nozzle.hpp"
#include "unflex/verify/corners.hpp"
#include "unflex/verify/near_path.hpp"

namespace unflex::record {

class ShaperBench {
 public:
  // `model` is the printer of the settings; `machines` is the number of machines.
  ShaperBench(const verify::NozzleModel& model, std::span<const dynamics::ShaperKind> kinds,
              const std::optional<PrinterShaper>& printer_shaper, std::size_t machines);

  [[nodiscard]] bool is_empty() const { return shapers_.empty(); }

  // The state of a machine's nozzle without a shaper. Times must increase.
  void add(std::size_t machine, double time_s, const dynamics::NozzleMotionXY& unshaped);
  // All machines have come to this time of the path.
  void advance(const verify::ReferencePath& path, double time_s);
  // For how long a piece of the path is needed after its time, s.
  [[nodiscard]] double memory_s() const;

  // The printer's own shaper, if there is one, comes last.
  [[nodiscard]] std::vector<report::Contender> contenders() const;
  [[nodiscard]] double measured_s() const { return measured_s_; }

 private:
  struct Nozzle {
    rivals::ShapedNozzle shaped;
    double contour2_max_mm2 = 0.0;
    double sum_contour2 = 0.0;
  };
  struct Shaper {
    std::string name;
    bool drawn = false;
    std::vector<Nozzle> nozzles;  // one per machine; none if it is not defined for the printer
    // The first machine's, and its state at the last moment that was measured.
    verify::CornerGauge corners;
    double last_s = -1.0;
    dynamics::NozzleMotionXY last = {};
    bool printers_own = false;
  };

  void install(Shaper& shaper, const Axes<dynamics::ShaperPulses>& pulses, std::size_t machines);
  void measure(const verify::ReferencePath& path, bool counts);
  // The nozzle's way to where it is now.
  void look_at_corners(Shaper& shaper, const dynamics::NozzleMotionXY& state) const;
  [[nodiscard]] bool is_sampled(double time_s) const;

  double interval_s_;
  double lookahead_s_ = 0.0;
  std::vector<Shaper> shapers_;
  std::vector<double> last_add_s_;  // per machine
  std::vector<dynamics::NozzleMotionXY> last_;
  verify::NearPath near_;
  bool begun_ = false;
  std::size_t piece_ = 0;     // piece of the path at next_s_
  std::size_t followed_ = 0;  // pieces whose corners are known
  double next_s_ = 0.0;
  std::vector<Nozzle*> peaking_;
  std::size_t skipped_ = 0;
  std::size_t stride_ = 1;
  double at_stride_s_ = 0.0;
  double weight_s_ = 0.0;
  double measured_s_ = 0.0;
};

}  // namespace unflex::record
