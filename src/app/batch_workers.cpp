#include "batch_workers.hpp"

#include <algorithm>

namespace unflex::app {

unsigned BatchWorkers::workers_for_next(std::size_t waiting) const {
  if (free_workers_ == 0 || waiting == 0) {
    return 0;
  }
  return std::max(
      1U, free_workers_ / static_cast<unsigned>(std::min<std::size_t>(waiting, free_workers_)));
}

}  // namespace unflex::app
