# Linux on aarch64, such as a Raspberry Pi's; one static executable.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

set(UNFLEX_IPOPT OFF CACHE BOOL "")
set(UNFLEX_TESTS OFF CACHE BOOL "")
