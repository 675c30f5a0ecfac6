#pragma once

#include <utility>

#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"

namespace unflex::study {

// The values of both axes, or the error of the first that has one.
template <typename T>
[[nodiscard]] Result<Axes<T>> values_of(Axes<Result<T>> results) {
  for (std::size_t axis = 0; axis < results.kCount; ++axis) {
    if (!results[axis]) {
      return tl::unexpected(results[axis].error());
    }
  }
  Axes<T> values;
  for_each_axis([](T& value, Result<T>& result) { value = std::move(*result); }, values, results);
  return values;
}

}  // namespace unflex::study
