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

// Every line of the input that is no motion stands in the output, byte for byte, in order, and at
// the same place along the path; whatever else the output holds is motion or a line of unflex's
// own.
void expect_lines_kept(const std::string& input, const std::string& output);

}  // namespace unflex::pipeline::testing
