# `cpack` in the build directory makes Debian packages of what is installed: unflex and libunflex-dev,
# or unflex alone where the build is for another processor.
set(UNFLEX_MAINTAINER "unflex contributors <unflex@unflex.invalid>" CACHE STRING
  "Whom the Debian packages name as maintainer, with an address")

set(CPACK_GENERATOR DEB)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_PACKAGE_NAME unflex)
set(CPACK_PACKAGE_VENDOR "unflex contributors")
# CPack would put this summary before each package's own.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL program)
if(NOT CMAKE_CROSSCOMPILING)
  list(APPEND CPACK_COMPONENTS_ALL development)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${UNFLEX_MAINTAINER}")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME unflex)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION misc)
if(CMAKE_CROSSCOMPILING)
  # A static program, which needs no library.
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${UNFLEX_DEBIAN_ARCHITECTURE})
  set(CPACK_STRIP_FILES OFF)
else()
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
endif()
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION
"G-code that takes the flex out of a 3D printer
The print head of a 3D printer hangs on belts and swings when it takes a
corner: walls show ringing, corners bulge. unflex reads sliced G-code, works
out how the motors must move so that the nozzle draws the sliced path, and
writes that motion as G-code for Klipper, Marlin or RepRapFirmware. It replays
what it wrote by the firmware's own rules and tells how far the nozzle strays,
before and after.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libunflex-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SOURCE unflex)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
# The packages that unflexDependencies.cmake looks for.
string(JOIN ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  pkg-config coinor-libipopt-dev libblas-dev liblapack-dev libeigen3-dev libexpected-dev libfmt-dev
  libtomlplusplus-dev nlohmann-json3-dev libzstd-dev zlib1g-dev)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION
"library that takes the flex out of a 3D printer, for development
unflex rewrites sliced G-code so that the nozzle of a 3D printer draws the
sliced path in spite of swinging. This package has its stages as a static
C++20 library, with headers and the files by which CMake finds it.")

# Debian requires a changelog in each package.
configure_file(share/debian/changelog.in ${PROJECT_BINARY_DIR}/package/changelog @ONLY)
unflex_gzip(${PROJECT_BINARY_DIR}/package/changelog ${PROJECT_BINARY_DIR}/package/changelog.gz)
target_sources(unflex_manual PRIVATE ${PROJECT_BINARY_DIR}/package/changelog.gz)
install(FILES ${PROJECT_BINARY_DIR}/package/changelog.gz DESTINATION ${CMAKE_INSTALL_DOCDIR}
  COMPONENT program)
if(NOT CMAKE_CROSSCOMPILING)
  install(FILES ${PROJECT_BINARY_DIR}/package/changelog.gz DESTINATION ${UNFLEX_DEVELOPMENT_DOCDIR}
    COMPONENT development)
endif()

include(CPack)
