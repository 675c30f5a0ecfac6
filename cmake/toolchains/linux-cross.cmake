# Linux on another processor, by Debian's compilers for it.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_C_COMPILER ${UNFLEX_COMPILER}-gcc)
set(CMAKE_CXX_COMPILER ${UNFLEX_COMPILER}-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -s")
set(UNFLEX_SYSTEM_LIBRARIES
  libc6-dev-${UNFLEX_DEBIAN_ARCHITECTURE}-cross libstdc++-12-dev-${UNFLEX_DEBIAN_ARCHITECTURE}-cross)
