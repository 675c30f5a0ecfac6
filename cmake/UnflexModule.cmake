# How modules are optimised: those whose loops take the time, all others, and those that shall build
# soon. A toolchain may say something else, such as for a program that shall be small.
set(UNFLEX_NUMERICAL_OPTIMISATION "" CACHE STRING "")
set(UNFLEX_PLAIN_OPTIMISATION -O2 CACHE STRING "")
set(UNFLEX_SOON_OPTIMISATION -O1 CACHE STRING "")
mark_as_advanced(UNFLEX_NUMERICAL_OPTIMISATION UNFLEX_PLAIN_OPTIMISATION UNFLEX_SOON_OPTIMISATION)

# unflex_module(name [NUMERICAL] SOURCES file... [LINKS target...])
#
# NUMERICAL: its loops are worth -O3. The others are compiled with -O2, which takes the compiler less
# time.
#
# Declares the static library unflex_<name> (alias unflex::<name>) from the sources of src/<name> and
# from the files of src/firmware that each firmware lists for the module. Headers for other modules
# are in src/<name>/include/unflex/<name>, and those for users of the library in
# include/unflex/<name>.
function(unflex_module name)
  cmake_parse_arguments(ARG "NUMERICAL" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  unflex_firmware_sources(firmware_sources ${name})
  add_library(unflex_${name} STATIC ${ARG_SOURCES} ${firmware_sources})
  add_library(unflex::${name} ALIAS unflex_${name})
  target_include_directories(unflex_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  # For its files in src/firmware.
  target_include_directories(unflex_${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_compile_features(unflex_${name} PUBLIC cxx_std_20)
  # Eigen would sum by as many numbers at once as the processor's registers hold, so in another order
  # on another processor. Wide registers are used in unflex/core/lanes.hpp, in one order.
  target_compile_definitions(unflex_${name} PUBLIC EIGEN_DONT_VECTORIZE
                                                   $<$<NOT:$<BOOL:${UNFLEX_THREADS}>>:UNFLEX_NO_THREADS>)
  target_link_libraries(unflex_${name} PUBLIC ${ARG_LINKS} PRIVATE ${ARG_PRIVATE_LINKS})
  unflex_flags(unflex_${name})
  set(kind PLAIN)
  if(ARG_NUMERICAL)
    set(kind NUMERICAL)
  endif()
  target_compile_options(unflex_${name} PRIVATE $<$<CONFIG:Release>:${UNFLEX_${kind}_OPTIMISATION}>)
  # The headers were compiled as fmt wants it. A module may be built with other sanitizers than they
  # are (tests/fuzz/CMakeLists.txt).
  if(fmt::fmt IN_LIST ARG_PRIVATE_LINKS AND NOT UNFLEX_SANITIZE)
    target_precompile_headers(unflex_${name} REUSE_FROM unflex_headers)
  endif()
endfunction()

# Warnings and sanitizers, the same for libraries, program and tests.
function(unflex_flags target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion)
  if(UNFLEX_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  # GCC 12 gives false alarm of these in std::string's own code, once that is inlined (GCC bugs 105329
  # and 105651).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow
                                             -Wno-stringop-overread)
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
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:${UNFLEX_SOON_OPTIMISATION}>)
endfunction()

# unflex_test_library(name file...): what several tests share.
function(unflex_test_library name)
  add_library(${name} STATIC ${ARGN})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PUBLIC unflex_test_paths GTest::gmock)
  unflex_flags(${name})
  unflex_build_soon(${name})
  target_precompile_headers(${name} REUSE_FROM unflex_test_headers)
endfunction()

# unflex_test(name [QUICK] [SLOW pattern...] SOURCES file... LINKS target...): one GoogleTest binary.
# ctest has each of its tests. QUICK: the target quick_tests builds it, and its tests are one test of
# ctest, with the label `quick`, since starting a process takes longer than most of them; those that
# match a pattern of SLOW are tests by themselves, without the label. Tests find what they read and
# run by paths.hpp.
function(unflex_test name)
  cmake_parse_arguments(ARG "QUICK" "" "SLOW;SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS} unflex_test_paths GTest::gmock GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  unflex_flags(${name})
  unflex_build_soon(${name})
  target_precompile_headers(${name} REUSE_FROM unflex_test_headers)
  set(by_themselves "*")
  if(ARG_QUICK)
    list(JOIN ARG_SLOW ":" by_themselves)
    add_dependencies(quick_tests ${name})
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1 "--gtest_filter=-${by_themselves}")
    set_tests_properties(${name} PROPERTIES TIMEOUT 600 LABELS quick)
  endif()
  if(by_themselves)
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_FILTER "${by_themselves}"
      PROPERTIES TIMEOUT 600)
  endif()
endfunction()
