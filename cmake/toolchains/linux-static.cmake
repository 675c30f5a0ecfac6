# Linux on x86-64 of any distribution; one static executable.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -s")
set(UNFLEX_SYSTEM_LIBRARIES libc6-dev libstdc++-12-dev)
set(UNFLEX_DEBIAN_ARCHITECTURE amd64)
