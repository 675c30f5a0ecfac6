# WebAssembly with WASI, by Debian's clang-22 and its libc++; for browsers and node.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_C_COMPILER clang-22)
set(CMAKE_CXX_COMPILER clang++-22)
set(CMAKE_C_COMPILER_TARGET wasm32-wasi)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# The compiler calls the target by another name than Debian's folders. Nothing is thrown in this
# build: where memory runs out, it traps.
set(CMAKE_C_FLAGS_INIT "-Wno-deprecated")
set(CMAKE_CXX_FLAGS_INIT "-Wno-deprecated -fignore-exceptions -isystem ${CMAKE_CURRENT_LIST_DIR}/wasm")
# Who catches an exception calls a function by its place in the table, and puts the stack back where
# it was. The program is made small later, from functions that are not yet put into each other.
set(CMAKE_EXE_LINKER_FLAGS_INIT
  "--no-wasm-opt -Wl,-z,stack-size=1048576 -Wl,--export=__stack_pointer -Wl,--export-table -s")
set(CMAKE_EXECUTABLE_SUFFIX .wasm)
# The page has the program in it, so what runs little is made small.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG" CACHE STRING "")
set(UNFLEX_NUMERICAL_OPTIMISATION -msimd128 CACHE STRING "")
set(UNFLEX_PLAIN_OPTIMISATION -Oz CACHE STRING "")
set(UNFLEX_SOON_OPTIMISATION -Oz CACHE STRING "")

set(UNFLEX_THREADS OFF CACHE BOOL "")
# clang does not share compiled headers between levels of optimisation.
set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON CACHE BOOL "")
set(UNFLEX_SYSTEM_LIBRARIES wasi-libc libc++-22-dev-wasm32 libc++abi-22-dev-wasm32)
