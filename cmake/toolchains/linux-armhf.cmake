# Linux on armv7l, such as a Raspberry Pi's; one static executable.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(CMAKE_C_COMPILER arm-linux-gnueabihf-gcc)
set(CMAKE_CXX_COMPILER arm-linux-gnueabihf-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -s")
set(UNFLEX_SYSTEM_LIBRARIES libc6-dev-armhf-cross libstdc++-12-dev-armhf-cross)
set(UNFLEX_DEBIAN_ARCHITECTURE armhf)
