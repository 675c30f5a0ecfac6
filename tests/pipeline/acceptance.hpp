// What must hold of a compensated print.
#pragma once

#include <string>

namespace unflex::pipeline::testing {

struct Expectation {
  unsigned workers = 1;
  // At least this many times less contour error (RMS while extruding) than before.
  double improvement = 1.0;
};

// Compensates the text with the default settings and checks the result.
void expect_compensated(const std::string& input, const Expectation& expectation);

}  // namespace unflex::pipeline::testing
