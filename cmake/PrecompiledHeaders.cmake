# The headers that most sources include take longer to read than many sources to compile, so they are
# compiled once: for the modules here, for the tests in tests/CMakeLists.txt. Every file includes
# what it uses all the same.
#
# The list is short on purpose. The larger the compiled headers, the longer every source takes to
# load them.
function(unflex_compile_headers name source)
  add_library(${name} OBJECT ${source})
  target_precompile_headers(${name} PRIVATE ${ARGN})
  target_compile_features(${name} PRIVATE cxx_std_20)
  unflex_flags(${name})
endfunction()

unflex_compile_headers(unflex_headers src/precompiled.cpp
  <algorithm> <array> <cmath> <cstddef> <memory> <optional> <string> <string_view> <utility> <vector>
  <fmt/core.h> <tl/expected.hpp>)
target_link_libraries(unflex_headers PRIVATE fmt::fmt tl::expected)
