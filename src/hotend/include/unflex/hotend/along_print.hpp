// The temperature along a print, and how far ahead a change of it must be asked for.
//
//   T₀, T₁   targets before and after a change
//   T∞       where the hotend would go: at full power, or without any where it cools
//   τ, θ'    the one lag that acts nearly as the two do (Plant::one_lag())
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "unflex/hotend/closed_loop.hpp"
#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

// A print as the hotend meets it, in steps of equal duration. Waiting for temperatures takes no
// step.
struct Course {
  static constexpr double kStep_s = 0.1;

  struct Step {
    float extruding_s = 0.0F;      // for how much of the step filament is laid
    float volume_mm3 = 0.0F;       // of that filament
    std::uint32_t first_line = 0;  // the line of the first move that begins in the step; 0: none
  };
  std::vector<Step> steps;
};

// How long the print waits at a command.
enum class Wait {
  none,
  heating,  // until the hotend is no colder than the target
  settled,  // until it is no colder and no hotter than the target
};

// A command to the hotend, at its place in a course.
struct Command {
  std::size_t line = 0;
  double time_s = 0.0;
  std::optional<double> target_c;  // 0: off; none: the command only waits
  Wait wait = Wait::none;
  // The target must not be asked for before this time, since something stands there that it must
  // not pass: another command to the hotend, a line that may be one, or the print's first
  // extrusion.
  double free_from_s = std::numeric_limits<double>::infinity();
  double laid_mm3 = 0.0;  // filament laid before it
  std::string text = {};  // the line that sets the target ahead, with its ending; empty: none can
};

// A target, and the time from which it is wanted.
struct Target {
  double time_s = 0.0;
  double target_c = 0.0;
};

// The hotend and its controller.
struct Loop {
  Plant plant;
  Control control;
  std::optional<double> heater_w = {};  // at full power, for the load of melting filament
};

// The response of the hotend along a course.
struct PrintResponse {
  // Where the simulation begins. None: no target is known, and nothing below is set.
  std::optional<double> known_from_s;
  // Time in which filament is laid further from the wanted target than the band, below and above.
  double colder_s = 0.0;
  double hotter_s = 0.0;
  // The largest distance from the wanted target while filament is laid, below 0 if it is too cold.
  double worst_c = 0.0;
  std::size_t worst_line = 0;        // the line of the move that lays it
  double waiting_s = 0.0;            // for temperatures, from known_from_s on
  std::vector<float> temperature_c;  // at the end of each step; not a number: not known

  [[nodiscard]] double out_of_band_s() const { return colder_s + hotter_s; }
};

// Simulates the hotend along a course. It rests at its target when filament first flows, since no
// print begins with a cold hotend. If the first target comes later, the simulation begins there,
// with the hotend at rest. Commands and wanted targets stand by rising time. A target of 0 wants
// nothing.
[[nodiscard]] PrintResponse print_response(const Loop& loop, const Course& course,
                                           const std::vector<Command>& commands,
                                           const std::vector<Target>& wanted, double band_c);

// The targets that commands set, each where it stands.
[[nodiscard]] std::vector<Target> targets(const std::vector<Command>& commands);

// How long it takes from asking for T₁ until the hotend passes T, between T₀ and T₁:
// θ' + τ ln((T∞ − T₀)/(T∞ − T)). nullopt if T is not between them, or if the hotend never comes
// there. Temperatures in °C.
[[nodiscard]] std::optional<double> lead_s(const Plant& plant, double from_c, double to_c,
                                           double passes_c);

// A command that is asked for earlier.
struct Ahead {
  std::size_t command = 0;      // its number among the commands
  std::size_t before_line = 0;  // the line that it then stands before
  double time_s = 0.0;          // when that is
  double from_c = 0.0;
  double to_c = 0.0;
};

// Which changes are asked for ahead: those to a higher temperature, or those to a lower one, too.
enum class AheadWhen { heating, both };

// Chooses the commands that are asked for ahead. A command that does not wait comes so early that
// the hotend enters the band around the new target when the command is due. If a command waits, its
// target comes so early that the hotend then leaves the band around the old target, so that the
// print waits less. A command that cannot stand so early stays. In the simulation filament is never
// laid outside the band for longer than with the commands in their places.
[[nodiscard]] std::vector<Ahead> choose_ahead(const Loop& loop, const Course& course,
                                              const std::vector<Command>& commands, double band_c,
                                              AheadWhen when);

// The commands with some of them asked for ahead. A command that waits is there twice: its target
// ahead, the wait in its place.
[[nodiscard]] std::vector<Command> with_ahead(const std::vector<Command>& commands,
                                              const std::vector<Ahead>& ahead);

}  // namespace unflex::hotend
