# unflex_firmware_sources(variable module): the files of all firmwares that a module compiles, sorted.
#
# Each folder of src/firmware tells in its sources.cmake which module compiles which of its files, as
# sources_of_<module>. So a further firmware is a further folder, and no module's CMakeLists.txt has
# to name its files.
function(unflex_firmware_sources variable module)
  file(GLOB lists CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/firmware/*/sources.cmake)
  set(all)
  foreach(list IN LISTS lists)
    set(sources_of_${module})
    include(${list})
    get_filename_component(folder ${list} DIRECTORY)
    list(TRANSFORM sources_of_${module} PREPEND ${folder}/)
    list(APPEND all ${sources_of_${module}})
  endforeach()
  set(${variable} ${all} PARENT_SCOPE)
endfunction()
