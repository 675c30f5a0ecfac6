# Looks for the libraries that unflex is built from. The build uses this file, and so does every
# project that links the library: it is installed beside unflexConfig.cmake. Sets
# unflex_NOT_FOUND_MESSAGE if something is missing. unflex_HAS_IPOPT says whether Ipopt is needed.
set(unflex_NOT_FOUND_MESSAGE)
set(unflex_missing)

# unflex_need(found NAME DEBIAN...): notes that NAME, which comes in Debian's packages DEBIAN, is
# missing, unless it was found.
macro(unflex_need found name)
  if(NOT ${found})
    list(APPEND unflex_missing "${name} (in Debian ${ARGN})")
  endif()
endmacro()

find_package(PkgConfig QUIET)
unflex_need(PKG_CONFIG_FOUND pkg-config pkg-config)
if(PKG_CONFIG_FOUND)
  if(unflex_HAS_IPOPT)
    pkg_check_modules(IPOPT QUIET IMPORTED_TARGET ipopt)
    # Ipopt links LAPACK and BLAS, which its package merely recommends.
    unflex_need(IPOPT_FOUND Ipopt coinor-libipopt-dev libblas-dev liblapack-dev)
  endif()
  pkg_check_modules(ZSTD QUIET IMPORTED_TARGET libzstd)
  unflex_need(ZSTD_FOUND Zstandard libzstd-dev)
endif()
find_path(TOMLPLUSPLUS_INCLUDE_DIR toml++/toml.h)
mark_as_advanced(TOMLPLUSPLUS_INCLUDE_DIR)
unflex_need(TOMLPLUSPLUS_INCLUDE_DIR toml++ libtomlplusplus-dev)
find_package(Threads QUIET)
unflex_need(Threads_FOUND threads libc6-dev)
find_package(ZLIB QUIET)
unflex_need(ZLIB_FOUND zlib zlib1g-dev)
find_package(Eigen3 3.4 QUIET NO_MODULE)
unflex_need(Eigen3_FOUND "Eigen 3.4" libeigen3-dev)
find_package(fmt QUIET)
unflex_need(fmt_FOUND fmt libfmt-dev)
find_package(nlohmann_json QUIET)
unflex_need(nlohmann_json_FOUND "JSON for Modern C++" nlohmann-json3-dev)
find_package(tl-expected QUIET)
unflex_need(tl-expected_FOUND tl::expected libexpected-dev)

if(unflex_missing)
  list(JOIN unflex_missing ", " unflex_missing)
  set(unflex_NOT_FOUND_MESSAGE "unflex is built from what is missing here: ${unflex_missing}")
endif()
