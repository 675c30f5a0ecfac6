// How the study's work is spread over threads.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "unflex/study/study.hpp"

namespace unflex::study {

// Calls work(i) for i = 0 … count − 1 in several threads, in any order.
void in_parallel(std::size_t count, unsigned workers, const std::function<void(std::size_t)>& work);

[[nodiscard]] std::unique_ptr<compensate::Engine> make_engine(const Options& options);

// Ipopt's linear solver must not run in two threads.
[[nodiscard]] unsigned threads(const Options& options);

}  // namespace unflex::study
