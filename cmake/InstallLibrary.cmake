# What `cmake --install` puts of the library where, as the component `development`: archives, headers
# and what find_package(unflex) reads.
include(CMakePackageConfigHelpers)

# --- the library: all modules but the program's own, and unflex::unflex, which stands for them
set(library_modules ${UNFLEX_MODULES})
list(REMOVE_ITEM library_modules app)
add_library(unflex_unflex INTERFACE)
add_library(unflex::unflex ALIAS unflex_unflex)
set_target_properties(unflex_unflex PROPERTIES EXPORT_NAME unflex)
install(TARGETS unflex_unflex EXPORT unflexTargets)
foreach(module IN LISTS library_modules)
  set_target_properties(unflex_${module} PROPERTIES EXPORT_NAME ${module})
  target_link_libraries(unflex_unflex INTERFACE unflex_${module})
  install(TARGETS unflex_${module} EXPORT unflexTargets ARCHIVE COMPONENT development)
endforeach()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/unflex)
install(EXPORT unflexTargets NAMESPACE unflex:: DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(cmake/unflexConfig.cmake.in
  ${PROJECT_BINARY_DIR}/package/unflexConfig.cmake INSTALL_DESTINATION ${package_dir})
# Below 1.0 every minor version may change what is public.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/unflexConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/package/unflexConfig.cmake
  ${PROJECT_BINARY_DIR}/package/unflexConfigVersion.cmake cmake/unflexDependencies.cmake
  DESTINATION ${package_dir} COMPONENT development)
install(DIRECTORY include/unflex DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.hpp")
set(UNFLEX_DEVELOPMENT_DOCDIR ${CMAKE_INSTALL_DATADIR}/doc/libunflex-dev)
install(DIRECTORY examples/library DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
  COMPONENT development)
install(FILES ${PROJECT_BINARY_DIR}/package/copyright DESTINATION ${UNFLEX_DEVELOPMENT_DOCDIR}
  COMPONENT development)
