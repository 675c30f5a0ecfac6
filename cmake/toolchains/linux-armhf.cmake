# Linux on armv7l, such as a Raspberry Pi's; one static executable.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(CMAKE_C_COMPILER arm-linux-gnueabihf-gcc)
set(CMAKE_CXX_COMPILER arm-linux-gnueabihf-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

set(UNFLEX_IPOPT OFF CACHE BOOL "")
set(UNFLEX_TESTS OFF CACHE BOOL "")
