// Checks that every compensated print must pass.
#pragma once

#include <string>

namespace unflex::flow::testing {

struct Expectation {
  unsigned workers = 1;
  // The contour error (RMS while extruding) must shrink at least by this factor.
  double improvement = 1.0;
};

// Compensates the text with the default settings and checks the result.
void expect_compensated(const std::string& input, const Expectation& expectation);

}  // namespace unflex::flow::testing
