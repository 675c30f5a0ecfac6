// Ipopt on an nlp::Problem. No other file of unflex sees Ipopt.
//
// Wächter & Biegler, "On the implementation of an interior-point filter line-search algorithm for
// large-scale nonlinear programming", Math. Program. 106 (2006). MUMPS underneath is not
// thread-safe: never solve in two threads of one process at once.
#pragma once

#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/nlp/problem.hpp"

namespace unflex::nlp {

struct SolverOptions {
  double tolerance = 1e-7;  // largest scaled optimality error
  int max_iterations = 200;
  // The start is near the solution, and the unknowns are about 1. Ipopt then stays close to the
  // start, even where that is close to bounds.
  bool warm = false;
};

enum class Outcome {
  solved,
  not_converged,  // iteration limit, restoration failure, infeasible …
};

struct Solution {
  Outcome outcome = Outcome::not_converged;
  std::string message;  // not_converged: Ipopt's status and the worst violated constraint
  std::vector<double> x;
  std::vector<double> lambda;  // multipliers of g
  double objective = 0.0;
  int iterations = 0;
};

// Errors (kind internal): Ipopt refuses an option or cannot be set up. Not converging is no error.
[[nodiscard]] Result<Solution> solve(const Problem& problem, const SolverOptions& options);

// "ipopt 3.11.9"
[[nodiscard]] std::string solver_version();

}  // namespace unflex::nlp
