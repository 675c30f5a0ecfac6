# Linux on aarch64, such as a Raspberry Pi's; one static executable.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -s")
set(UNFLEX_SYSTEM_LIBRARIES libc6-dev-arm64-cross libstdc++-12-dev-arm64-cross)
set(UNFLEX_DEBIAN_ARCHITECTURE arm64)
