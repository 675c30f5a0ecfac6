# unflex_module(name SOURCES file... [LINKS target...])
#
# Declares the static library unflex_<name> (alias unflex::<name>) from the sources of
# src/<name>, with its public headers in include/unflex/<name>.
function(unflex_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(unflex_${name} STATIC ${ARG_SOURCES})
  add_library(unflex::${name} ALIAS unflex_${name})
  target_include_directories(unflex_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(unflex_${name} PUBLIC cxx_std_20)
  target_link_libraries(unflex_${name} PUBLIC ${ARG_LINKS} PRIVATE ${ARG_PRIVATE_LINKS})
  unflex_flags(unflex_${name})
endfunction()

# Warnings and sanitizers, the same for libraries, program and tests.
function(unflex_flags target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion)
  if(UNFLEX_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  # Contraction into fused multiply-adds would make the emitted bytes depend on the machine.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  if(UNFLEX_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${UNFLEX_SANITIZE} -fno-omit-frame-pointer
                                             -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${UNFLEX_SANITIZE})
  endif()
endfunction()

# For what runs so little that building it takes longer: about half as long as with -O3.
function(unflex_build_soon target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# unflex_test(name SOURCES file... LINKS target...): one GoogleTest binary, discovered by ctest.
# Tests read their data from UNFLEX_TEST_DATA and whole sample prints from UNFLEX_SAMPLES, where
# that folder exists.
function(unflex_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS} GTest::gmock GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(${name} PRIVATE
    UNFLEX_TEST_DATA="${PROJECT_SOURCE_DIR}/tests/data"
    UNFLEX_EXAMPLES="${PROJECT_SOURCE_DIR}/examples"
    UNFLEX_SHARED="${PROJECT_SOURCE_DIR}/../shared")
  unflex_flags(${name})
  unflex_build_soon(${name})
  target_precompile_headers(${name} REUSE_FROM unflex_test_headers)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
