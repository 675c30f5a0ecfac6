// Chooses the fit of a record to trust.
#pragma once

#include <string>
#include <vector>

#include "band.hpp"
#include "modes_search.hpp"

namespace unflex::identify {

// Another fit that is nearly as good, with another response.
struct Rival {
  Eigen::VectorXd theta;
  double odds = 0.0;            // to the best's 1
  bool has_other_main = false;  // its main mode is none of the best's, or the other way round
};

struct Choice {
  const Solution* best = nullptr;  // none: no fit is to be trusted
  Eigen::VectorXd theta;           // of the best, or else of the closest; main mode first
  std::vector<Rival> rivals;
  std::string doubt;       // of the closest of all, where it is not the best
  double closer_by = 0.0;  // how much better the closest of all then is
  Eigen::MatrixXd spread;  // of (log f, log ζ, g) among the fits that nearly equal the best
};

// Whether the rivals have other main modes, so that the record leaves the main mode open.
[[nodiscard]] bool has_other_main(const Choice& choice);

// `found`: the result of search().
[[nodiscard]] Choice choose(const std::vector<std::vector<Solution>>& found, const Band& band,
                            const ModesModel& model);

}  // namespace unflex::identify
