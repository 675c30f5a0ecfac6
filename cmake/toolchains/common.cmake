# What all builds for other systems have in common. Tests run where they are built, and Ipopt is not
# at hand for other systems.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(UNFLEX_IPOPT OFF CACHE BOOL "")
set(UNFLEX_TESTS OFF CACHE BOOL "")
