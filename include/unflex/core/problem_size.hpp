// How large a problem is that a method solves for a motion.
#pragma once

#include <cstddef>

namespace unflex {

// Several problems add up.
struct ProblemSize {
  std::size_t unknowns = 0;  // 0: there is nothing to solve
  std::size_t equations =
      0;  // that they keep, or come near to as least squares; limits not counted

  void add(const ProblemSize& other) {
    unknowns += other.unknowns;
    equations += other.equations;
  }
};

}  // namespace unflex
