// How the solutions of two windows meet.
#pragma once

#include <cstddef>

namespace unflex::compensate {

// Half the number of nodes over which two windows are blended.
inline constexpr std::size_t kBlendNodes = 10;

}  // namespace unflex::compensate
