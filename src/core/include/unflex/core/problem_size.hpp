// The size of the problem that a method solves to make a base.
#pragma once

#include <cstddef>

namespace unflex {

// The sizes of several problems may be added.
struct ProblemSize {
  std::size_t unknowns = 0;  // 0: there is nothing to solve
  // Equations that the unknowns satisfy, exactly or as least squares. Limits do not count.
  std::size_t equations = 0;

  void add(const ProblemSize& other) {
    unknowns += other.unknowns;
    equations += other.equations;
  }
};

}  // namespace unflex
