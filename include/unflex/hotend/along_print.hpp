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

// A print in steps of equal duration, as the hotend meets it.
struct Course {
  static constexpr double kStep_s = 0.1;

  struct Step {
    float extruding_s = 0.0F;      // for how much of the step filament is laid
    float volume_mm3 = 0.0F;       // of that filament
    std::uint32_t first_line = 0;  // the line of the first move that begins in the step; 0: none
  };
  std::vector<Step> steps;
};

// How long a command holds up the print.
enum class Wait {
  none,
  heating,  // until the hotend is no colder than the target
  settled,  // until it is no colder and no hotter than the target
};

// A command to the hotend, at its place in a course. Waiting takes no time of the course.
struct Command {
  std::size_t line = 0;
  double time_s = 0.0;
  std::optional<double> target_c;  // 0: off; none: the command only waits
  Wait wait = Wait::none;
  // No change may be asked for before this time, since something else stands there: another command
  // to the hotend, a line that may be one, or the print's first extrusion.
  double free_from_s = std::numeric_limits<double>::infinity();
  double laid_mm3 = 0.0;  // filament laid before it
  std::string text = {};  // the line that sets the target ahead of this place; empty: none can
};

// What holds from a time on.
struct Target {
  double time_s = 0.0;
  double target_c = 0.0;
};

struct Loop {
  Plant plant;
  Control control;
  std::optional<double> heater_w = {};  // at full power, for the load of melting filament
};

struct Along {
  std::optional<double> known_from_s;  // where the simulation begins; none: no target is known
  double colder_s = 0.0;               // of extrusion further than the band below what is wanted
  double hotter_s = 0.0;
  double worst_c = 0.0;  // the largest distance from what is wanted while filament is laid; with
                         // its sign
  std::size_t worst_line = 0;
  double waiting_s = 0.0;            // for temperatures, from the first extrusion on
  std::vector<float> temperature_c;  // at the end of each step; not a number: not known

  [[nodiscard]] double out_of_band_s() const { return colder_s + hotter_s; }
};

// Simulates the hotend along a course. It rests at its target when filament first flows: no print
// begins with a cold hotend. If the first target comes later, it rests at that from there on.
// wanted: by rising time; a target of 0 wants nothing.
[[nodiscard]] Along along(const Loop& loop, const Course& course,
                          const std::vector<Command>& commands, const std::vector<Target>& wanted,
                          double band_c);

// The targets that commands set, each where it stands.
[[nodiscard]] std::vector<Target> targets(const std::vector<Command>& commands);

// How long it takes from asking for T₁ until the hotend passes T, between T₀ and T₁:
// θ' + τ ln((T∞ − T₀)/(T∞ − T)). nullopt if T is not between them, or if the hotend cannot come
// there.
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

enum class AheadWhen { heating, both };

// Chooses the commands that are asked for ahead. Each comes so early that the hotend enters the
// band around its target when it is due. One that waits comes so early that the hotend leaves the
// band around the target before it when it is due; it then waits less. What cannot stand so early
// stays. Filament is never laid out of the band for longer than without.
[[nodiscard]] std::vector<Ahead> choose_ahead(const Loop& loop, const Course& course,
                                              const std::vector<Command>& commands, double band_c,
                                              AheadWhen when);

// The commands with some of them asked for ahead. One that waits is there twice: its target ahead,
// the waiting in its place.
[[nodiscard]] std::vector<Command> with_ahead(const std::vector<Command>& commands,
                                              const std::vector<Ahead>& ahead);

}  // namespace unflex::hotend
