# Linux on aarch64, such as a Raspberry Pi's; one static executable.
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(UNFLEX_DEBIAN_ARCHITECTURE arm64)
set(UNFLEX_COMPILER aarch64-linux-gnu)
include(${CMAKE_CURRENT_LIST_DIR}/linux-cross.cmake)
