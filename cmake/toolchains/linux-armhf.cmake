# Linux on armv7l, such as a Raspberry Pi's; one static executable.
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(UNFLEX_DEBIAN_ARCHITECTURE armhf)
set(UNFLEX_COMPILER arm-linux-gnueabihf)
# Without this GCC remarks on each call that GCC 6 compiled in another way.
set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)
include(${CMAKE_CURRENT_LIST_DIR}/linux-cross.cmake)
