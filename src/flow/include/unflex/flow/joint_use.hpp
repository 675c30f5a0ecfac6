// What a print asks of a machine's joints.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {

// A largest value and where it occurs.
struct Largest {
  double value = 0.0;
  std::size_t line = 0;
};

struct JointUse {
  std::string name;
  double min_mm = 0.0;
  double max_mm = 0.0;
  std::optional<machine::Range> range_mm;  // that the settings allow
  Largest speed_mm_s;
  Largest accel_mm_s2;
};

// A move that goes where the machine cannot be.
struct Miss {
  std::size_t line = 0;
  std::string why;
};

struct PrintInJoints {
  std::array<JointUse, 3> joints;
  std::size_t moves = 0;          // whose joints are known
  std::size_t unknown_moves = 0;  // that begin at a place that the text does not tell
  double condition = 0.0;         // the largest of J along the print
  std::size_t missed_moves = 0;
  std::size_t missed_lines = 0;  // with such moves; an arc has several
  std::vector<Miss> misses;      // one for each of these lines, at most kMostMisses
  bool has_reach = false;        // whether the settings limit the joints at all
  std::vector<std::string> warnings;
};

inline constexpr std::size_t kMostMisses = 1000;

// Plans the print as the firmware does and follows its joints. Where J changes from place to place,
// the speeds and accelerations are bounds.
[[nodiscard]] Result<PrintInJoints> print_in_joints(const Job& job, Progress& progress);

}  // namespace unflex::flow
