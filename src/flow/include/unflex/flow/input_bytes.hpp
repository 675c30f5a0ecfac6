// How much there is to read, for progress.
#pragma once

#include "unflex/flow/flow.hpp"

namespace unflex::flow {

// 0 if the size is not known: for a stream, or a file whose name is gone since it was opened.
[[nodiscard]] inline double input_bytes(const Job& job) {
  return job.input_stream ? 0.0 : static_cast<double>(job.input->bytes().value_or(0));
}

// −1, unknown progress, if the size is not known.
[[nodiscard]] inline double share_of_input(double done_bytes, double input_bytes) {
  return input_bytes > 0.0 ? done_bytes / input_bytes : -1.0;
}

}  // namespace unflex::flow
