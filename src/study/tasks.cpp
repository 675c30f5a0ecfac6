#include "tasks.hpp"

#include <algorithm>
#include <atomic>
#include <vector>

#include "unflex/core/threads.hpp"

namespace unflex::study {

void in_parallel(std::size_t count, unsigned workers,
                 const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  const auto loop = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      work(i);
    }
  };
  std::vector<Thread> threads;
  for (unsigned i = 1; i < std::min<std::size_t>(workers, count); ++i) {
    threads.emplace_back(loop);
  }
  loop();
}

std::unique_ptr<compensate::Engine> make_engine(const Options& options) {
  return options.ipopt ? compensate::make_ipopt_engine() : compensate::make_banded_engine();
}

unsigned threads(const Options& options) { return options.ipopt ? 1 : options.workers; }

}  // namespace unflex::study
