// Rules that choose a controller's gains.
//
//   u = K_p e + K_i ∫e dt + K_d de/dt,   e = target − T
//
// This is the parallel form. Rules are stated in the ideal form, u = k (e + ∫e dt / T_i + T_d
// de/dt), so that K_p = k, K_i = k/T_i and K_d = k T_d. Whoever puts 1/T_i and T_d into a parallel
// controller gets an integral that is k times too weak.
#pragma once

#include <string_view>

#include "unflex/core/error.hpp"
#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

struct Gains {
  double p = 0.0;  // counts per °C
  double i = 0.0;  // counts per °C and s
  double d = 0.0;  // counts per °C/s
};

enum class Rule {
  simc_pid,       // Skogestad 2003, for two lags
  simc_pi,        // Skogestad 2003, for one lag
  zn_pid,         // Ziegler and Nichols 1942, by the ultimate cycle
  zn_pi,          // Ziegler and Nichols 1942, by the ultimate cycle
  cohen_coon,     // Cohen and Coon 1953, for one lag
  tyreus_luyben,  // Tyreus and Luyben 1992, by the ultimate cycle
};

inline constexpr Rule kDefaultRule = Rule::simc_pid;

// "simc", "simc-pi", "zn", "zn-pi", "cc", "tl": the words of a command line.
[[nodiscard]] std::string_view to_string(Rule rule);

// The rules by the ultimate cycle count with a controller that samples every kUsualSample_s. An
// error of kind input if the plant has no dead time, or is none.
[[nodiscard]] Result<Gains> gains(Rule rule, const Plant& plant);

// For the rules by the ultimate cycle, from a test that found it. An error of kind usage for the
// others, and of kind input if a value is not above 0.
[[nodiscard]] Result<Gains> gains(Rule rule, const Ultimate& ultimate);

}  // namespace unflex::hotend
