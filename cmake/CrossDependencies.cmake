# What unflex is built from where the build is for another system than it runs on: libraries that are
# headers alone, which serve every system, and others from Debian's sources.
set(headers ${PROJECT_BINARY_DIR}/headers_of_all_systems)
file(MAKE_DIRECTORY ${headers})
foreach(folder CLI fmt nlohmann tl toml++)
  if(NOT EXISTS /usr/include/${folder})
    message(FATAL_ERROR "There is no /usr/include/${folder}; run cmake/install_packages.sh")
  endif()
  file(CREATE_LINK /usr/include/${folder} ${headers}/${folder} SYMBOLIC)
endforeach()

# unflex_header_library(TARGET FOLDER [DEFINITION...])
function(unflex_header_library target folder)
  string(REGEX REPLACE "::.*" "_headers" name ${target})
  add_library(${name} INTERFACE)
  add_library(${target} ALIAS ${name})
  target_include_directories(${name} SYSTEM INTERFACE ${folder})
  target_compile_definitions(${name} INTERFACE ${ARGN})
endfunction()

unflex_header_library(CLI11::CLI11 ${headers})
unflex_header_library(fmt::fmt ${headers} FMT_HEADER_ONLY)
unflex_header_library(nlohmann_json::nlohmann_json ${headers})
unflex_header_library(tl::expected ${headers})
unflex_header_library(Eigen3::Eigen /usr/include/eigen3)
set(TOMLPLUSPLUS_INCLUDE_DIR ${headers})

if(UNFLEX_THREADS)
  find_package(Threads REQUIRED)
endif()

# unflex_debian_library(TARGET PACKAGE FOLDER FILE...): a library of the files of a source package.
# FOLDER has its headers. The package is unpacked in the build directory, or where
# UNFLEX_SOURCES says.
set(UNFLEX_SOURCES ${PROJECT_BINARY_DIR}/sources CACHE PATH "Folder of unpacked Debian sources")
function(unflex_debian_library target package folder)
  set(root ${UNFLEX_SOURCES}/${package})
  if(NOT EXISTS ${root})
    execute_process(COMMAND ${PROJECT_SOURCE_DIR}/cmake/debian_source.sh ${package} ${root}
      COMMAND_ERROR_IS_FATAL ANY)
  endif()
  string(REPLACE "::" "_" name ${target})
  set(files)
  foreach(pattern IN LISTS ARGN)
    file(GLOB found ${root}/${pattern})
    list(APPEND files ${found})
  endforeach()
  add_library(${name} STATIC ${files})
  add_library(${target} ALIAS ${name})
  target_include_directories(${name} SYSTEM PUBLIC ${root}/${folder})
  target_compile_options(${name} PRIVATE -O2 -w)
endfunction()

enable_language(C)
unflex_debian_library(ZLIB::ZLIB zlib .
  adler32.c compress.c crc32.c deflate.c inffast.c inflate.c inftrees.c trees.c uncompr.c zutil.c)
unflex_debian_library(PkgConfig::ZSTD libzstd lib lib/common/*.c lib/decompress/*.c)
target_compile_definitions(PkgConfig_ZSTD PRIVATE ZSTD_DISABLE_ASM=1)
