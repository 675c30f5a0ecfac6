#include "same_print.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace unflex::testing {
namespace {

constexpr std::string_view kMark = ";line ";
constexpr std::string_view kOwn = ";unflex ";
constexpr std::array<const char*, 3> kAxes = {"X", "Y", "Z"};

// Coordinates are written with four decimals.
constexpr double kPosition_mm = 0.6e-4;
constexpr double kOffset_mm = 1e-9;
// Filament is written with five decimals; the remainder goes to the next line.
constexpr double kFilament_mm = 2e-5;
// Error of Marlin and RepRapFirmware, which count in single precision, far from zero or after many
// lines.
constexpr double kSingle_mm = 5e-3;
constexpr double kSingle = std::numeric_limits<float>::epsilon();
// Tolerance for the reading of E after a macro, where unflex cannot correct it because it is
// unknown. M221 may fall between two lines of a run and split its effect.
constexpr double kMoment_mm = 5e-2;
constexpr double kFeed = 1e-6;
// Relative tolerance for a limit, which Marlin and RepRapFirmware keep in single precision too.
constexpr double kLimit = 2e-7;
// How far a base may leave the path.
constexpr double kSwing_mm = 2.0;
// How much filament a run may pull back or push beyond what its lines do.
constexpr double kPulled_mm = 5e-3;
// Half a step of Z: Marlin and RepRapFirmware get whole steps.
constexpr double kStep_mm = 1.3e-3;
// Marlin adds motion of less than six steps to the next line (MIN_STEPS_PER_SEGMENT), so a run may
// begin that much lower than its lines.
constexpr double kUnqueued_mm = 6.0 / 400.0;

// Whether the line tells a duration; unflex rewrites such lines.
bool tells_duration(std::string_view line) {
  return line.starts_with("M73") || line.starts_with(";TIME") ||
         line.find("estimated printing time") != std::string_view::npos;
}

// Whether the line is the first of those that restore the file's own limits.
bool sets_limits(std::string_view line) {
  return line.starts_with("SET_VELOCITY_LIMIT ") || line.starts_with("M201 ");
}

// end_of_run: after a run, nothing may move until the limits are restored.
enum class Part { kept, run, end_of_run };

// The range of places and of filament that a stretch of lines covers.
struct Extent {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  std::array<double, 4> least_mm{kNone, kNone, kNone, kNone};
  std::array<double, 4> most_mm{-kNone, -kNone, -kNone, -kNone};

  void add(const std::array<double, 3>& place, double filament_mm) {
    const std::array<double, 4> at = {place[0], place[1], place[2], filament_mm};
    for (std::size_t axis = 0; axis < at.size(); ++axis) {
      least_mm[axis] = std::min(least_mm[axis], at[axis]);
      most_mm[axis] = std::max(most_mm[axis], at[axis]);
    }
  }
  void add_line(const TextMachine& machine) {
    add(machine.reading().position_mm, machine.reading().filament_mm);
    for (const std::array<double, 3>& place : machine.path()) {
      add(place, machine.reading().filament_mm);
    }
  }
  [[nodiscard]] bool empty() const { return least_mm[0] > most_mm[0]; }
};

// Reads both texts side by side: at each mark of the emitted text, reads the sliced text up to that
// mark.
class Comparison {
 public:
  Comparison(std::string_view sliced, const Printer& printer)
      : printer_(printer),
        rest_(sliced),
        sliced_(printer.firmware, printer.retraction),
        emitted_(printer.firmware, printer.retraction) {}

  std::string run(std::string_view emitted) {
    while (!emitted.empty() && difference_.empty()) {
      const std::string_view line = take_line(emitted);
      read_emitted_line(line);
      // Klipper ends the print at a refused line.
      if (printer_.firmware == Firmware::klipper && sliced_.refused() > 0) {
        expect(emitted_.refused() > 0, "what is refused is not");
        return difference_;
      }
    }
    place_ = "the end";
    expect(rest_.empty(), "lines are lost");
    expect(part_ == Part::kept, "a run does not end");
    compare();
    // From the first run on the shaper is off, except for what moves by itself.
    compare_limits(true);
    expect(emitted_.refused() == sliced_.refused(), "a line is refused");
    return difference_;
  }

 private:
  // What a run sets must not hold for the move before it, nor the file's limits for a line of a
  // run.
  void read_emitted_line(std::string_view line) {
    const bool limits_act_early = emitted_.move_waits() && part_ != Part::kept;
    const std::map<std::string, double> before =
        limits_act_early ? limits_in_force() : std::map<std::string, double>();
    emitted_.read(line);
    expect(!limits_act_early || limits_in_force() == before, "limits change while a move waits");
    follow(line);
  }

  // The limits that the emitted text has set, or else the printer's own.
  [[nodiscard]] std::map<std::string, double> limits_in_force() const {
    std::map<std::string, double> limits = emitted_.reading().limits;
    limits.insert(printer_.limits.begin(), printer_.limits.end());
    return limits;
  }

  void follow(std::string_view line) {
    if (line.starts_with(";unflex run")) {
      part_ = Part::run;
      run_seen_ = true;
    } else if (line == ";unflex end") {
      part_ = Part::end_of_run;
    } else if (part_ == Part::end_of_run && sets_limits(line)) {
      part_ = Part::kept;
    }
    expect(part_ != Part::end_of_run || emitted_.path().empty(), "motion by the limits of a run");
    if (part_ == Part::run) {
      run_.add_line(emitted_);
    }
    if (line.starts_with(kMark)) {
      follow_mark(line);
    } else {
      since_mark_.insert(line);
    }
  }

  void follow_mark(std::string_view mark) {
    const std::string_view own = read_sliced_line();
    place_ = fmt::format("{}: {}", mark.substr(1), own);
    expect(take_line(rest_) == mark, "lines are out of order");
    if (part_ == Part::kept) {
      compare();
      compare_extents();
      expect(run_seen_ || tells_duration(own) || since_mark_.contains(own), "the line is lost");
      lines_ = {};
      run_ = {};
      run_seen_ = false;
    }
    since_mark_.clear();
  }

  std::string_view read_sliced_line() {
    const std::string_view line = take_line(rest_);
    lines_.add(sliced_.reading().position_mm, sliced_.reading().filament_mm);
    sliced_.read(line);
    lines_.add_line(sliced_);
    return line;
  }

  // Keeps the first difference.
  void expect(bool holds, std::string_view otherwise) {
    if (!holds && difference_.empty()) {
      difference_ = fmt::format("{}: {}", place_, otherwise);
    }
  }
  void expect_near(std::string_view what, double emitted, double sliced, double leeway) {
    expect(emitted == sliced || std::abs(emitted - sliced) <= leeway,  // == for infinity
           fmt::format("{} is {:.9g} instead of {:.9g}", what, emitted, sliced));
  }

  void compare_extents() {
    if (run_.empty()) {
      return;
    }
    const bool leaves_steps = printer_.firmware == Firmware::marlin;
    const double height_mm = kStep_mm + (leaves_steps ? kUnqueued_mm : 0.0);
    const std::array<double, 4> leeway_mm = {kSwing_mm, kSwing_mm, height_mm, kPulled_mm};
    for (std::size_t axis = 0; axis < leeway_mm.size(); ++axis) {
      const double least_mm = lines_.least_mm[axis] - leeway_mm[axis];
      const double most_mm = lines_.most_mm[axis] + leeway_mm[axis];
      expect(run_.least_mm[axis] >= least_mm && run_.most_mm[axis] <= most_mm,
             fmt::format("a run leaves its lines along {}", "XYZE"[axis]));
    }
  }

  void compare() {
    const Reading& sliced = sliced_.reading();
    const Reading& emitted = emitted_.reading();
    const bool in_double = printer_.firmware == Firmware::klipper;
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      expect(emitted.known[axis] == sliced.known[axis], "it is homed otherwise");
      const double word_mm = sliced.position_mm[axis] - sliced.offset_mm[axis];
      const double leeway_mm = kPosition_mm + (in_double ? 0.0 : kSingle * std::abs(word_mm));
      expect_near(kAxes[axis], emitted.position_mm[axis], sliced.position_mm[axis], leeway_mm);
      expect_near("zero", emitted.offset_mm[axis], sliced.offset_mm[axis],
                  in_double ? kOffset_mm : leeway_mm);
    }
    const double leeway_mm = kFilament_mm + (in_double ? 0.0 : kSingle_mm);
    expect_near("filament", emitted.filament_mm, sliced.filament_mm, leeway_mm);
    expect_near("the reading of E", emitted.e_reading_mm, sliced.e_reading_mm,
                sliced_.not_followed().empty() ? leeway_mm : kMoment_mm);
    expect_near("F", emitted.feed_mm_s, sliced.feed_mm_s, kFeed * sliced.feed_mm_s);
    expect_near("M220", emitted.speed_factor, sliced.speed_factor, 0.0);
    expect_near("M221", emitted.flow_factor, sliced.flow_factor, 0.0);
    expect(emitted.absolute_xyz == sliced.absolute_xyz, "G90 and G91 differ");
    expect(emitted.absolute_e == sliced.absolute_e, "M82 and M83 differ");
    expect(emitted.inches == sliced.inches, "G20 and G21 differ");
    expect(emitted.retracted == sliced.retracted, "G10 and G11 differ");
    compare_limits(false);
  }

  void compare_limits(bool shaper) {
    const std::map<std::string, double>& set = sliced_.reading().limits;
    for (const auto& [name, value] : emitted_.reading().limits) {
      if (name.starts_with("shaper") != shaper) {
        continue;
      }
      const bool is_set = set.contains(name);
      if (is_set || printer_.limits.contains(name)) {
        const double wanted = is_set ? set.at(name) : printer_.limits.at(name);
        expect_near(name, value, wanted, kLimit * std::abs(wanted));
      } else {
        expect(false, fmt::format("{} is set to {}, which nobody has said", name, value));
      }
    }
  }

  const Printer& printer_;
  std::string_view rest_;  // unread rest of the sliced text
  TextMachine sliced_;
  TextMachine emitted_;
  Part part_ = Part::kept;
  std::string place_;
  std::string difference_;
  // Lines since the last mark.
  std::set<std::string_view> since_mark_;
  // Extents since the last mark outside of a run.
  Extent lines_;
  Extent run_;
  bool run_seen_ = false;
};

}  // namespace

bool has_marks(std::string_view gcode) {
  return gcode.find(kMark) != std::string_view::npos || gcode.find(kOwn) != std::string_view::npos;
}

std::string numbered(std::string_view gcode) {
  std::string text;
  for (std::size_t number = 0; !gcode.empty(); ++number) {
    text += fmt::format("{}\n{}{}\n", take_line(gcode), kMark, number);
  }
  return text;
}

std::string difference(std::string_view sliced, std::string_view emitted, const Printer& printer) {
  return Comparison(sliced, printer).run(emitted);
}

}  // namespace unflex::testing
