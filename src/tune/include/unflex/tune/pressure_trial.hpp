// Calibration of pressure advance by printing: each band of a tower is made for a hotend of another
// advance or dead time, and whoever looks at the walls tells in which bands they are even where the
// nozzle changes its speed.
//
//   K   pressure advance of the hotend, s       δ   its dead time, s       s = K + δ
//
// A band made for K' and δ' lays, for a flow q that is wanted, q + ε:
//
//   ε = ((1 + K' p) exp(δ' p)/((1 + K p) exp(δ p)) − 1) q ≈ (s' − s) p q/(1 + K p)
//                                                           + (δ' − δ) K p² q/(1 + K p)
//
// p being the derivative by time. So an error of s adds or takes filament, (s' − s) Δq in total for
// a change Δq of the flow. With s right, an error of δ only shifts some filament, there and back.
// Towers therefore try s and δ, not K and δ: an error of one hardly disturbs the other. The rounds
// alternate: s, s in finer steps, δ, s, δ, ….
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "unflex/core/error.hpp"
#include "unflex/tune/trial.hpp"

namespace unflex::tune {

// The knowledge of a hotend, and how far it may be off either way.
struct PressureKnowledge {
  double sum_s = 0.0;  // s; 0: nothing is known
  double sum_error_s = 0.0;
  double dead_time_s = 0.004;  // δ
  double dead_time_error_s = 0.005;
  std::size_t rounds = 0;  // prints read so far

  [[nodiscard]] bool has_sum() const { return sum_s > 0.0; }
  [[nodiscard]] double advance_s() const { return sum_s - dead_time_s; }
};

enum class PressureParameter { sum, dead_time };

// The values that one tower tries. Band n of 1 … bands has the value first · stepⁿ⁻¹ where nothing
// is known, otherwise first + (n − 1) · step.
struct PressureTrial {
  PressureParameter parameter = PressureParameter::sum;
  std::size_t bands = 0;
  double first_s = 0.0;
  double step = 0.0;             // a factor, or s
  PressureKnowledge known = {};  // before this tower

  [[nodiscard]] double value_s(std::size_t band) const;
  // The values that a band is made for.
  [[nodiscard]] double advance_s(std::size_t band) const;
  [[nodiscard]] double dead_time_s(std::size_t band) const;
};

// The trial of the next tower.
[[nodiscard]] PressureTrial next_trial(const PressureKnowledge& known);

// The knowledge that follows from the zone of even walls. If the zone reaches an end of the bands,
// the true value may lie beyond, and the known error is widened for this. Errors are of kind usage:
// the trial has no such bands.
[[nodiscard]] Result<PressureKnowledge> read(const PressureTrial& trial, const Zone& zone);

// Writes a trial as a line of comment in the tower's G-code, without its end, and reads it back.
// pressure_trial(): an error of kind input if the line begins like a trial but is none; `place` is
// the line's.
inline constexpr std::string_view kPressureMark = "; unflex tune: pressure";
[[nodiscard]] std::string to_comment(const PressureTrial& trial);
[[nodiscard]] Result<PressureTrial> pressure_trial(std::string_view line, const SourcePlace& place);

}  // namespace unflex::tune
