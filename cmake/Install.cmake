# What `cmake --install` puts of the program where, as the component `program`: what runs, with its
# manual, examples and completions.

# --- manual, examples and the terms under which all this may be used
find_program(UNFLEX_GZIP gzip REQUIRED)
# unflex_gzip(file result): `result` is `file` packed, the same bytes for the same file.
function(unflex_gzip file result)
  add_custom_command(OUTPUT ${result} COMMAND ${UNFLEX_GZIP} --best --no-name --stdout ${file}
    > ${result} DEPENDS ${file} VERBATIM)
endfunction()
unflex_gzip(${PROJECT_SOURCE_DIR}/docs/unflex.1 ${PROJECT_BINARY_DIR}/package/unflex.1.gz)
add_custom_target(unflex_manual ALL DEPENDS ${PROJECT_BINARY_DIR}/package/unflex.1.gz)
install(FILES ${PROJECT_BINARY_DIR}/package/unflex.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
  COMPONENT program)
# They lie as they do here, for the sake of their links.
install(FILES README.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program
  FILES_MATCHING PATTERN "*.md" PATTERN "*.svg" PATTERN "*.png")
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program
  PATTERN library EXCLUDE PATTERN quickstart.sh EXCLUDE)

# Headers of these libraries, by Debian's names of their packages, become part of what is built, and
# their licences ask to go with it.
set(copyright_file ${PROJECT_BINARY_DIR}/package/copyright)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS LICENSE)
file(READ LICENSE copyright)
string(PREPEND copyright "unflex, with all that its reports are made of (src/report/assets):\n\n")
set(parts libcli11-dev libeigen3-dev libexpected-dev libfmt-dev libtomlplusplus-dev
          nlohmann-json3-dev)
# One program without other files has all of its libraries in it.
if(CMAKE_CROSSCOMPILING)
  list(APPEND parts zlib1g-dev libzstd-dev ${UNFLEX_SYSTEM_LIBRARIES})
endif()
foreach(package IN LISTS parts)
  string(APPEND copyright "\n\nPart of the program and the library is code of ${package}")
  if(EXISTS /usr/share/doc/${package}/copyright)
    file(READ /usr/share/doc/${package}/copyright terms)
    string(APPEND copyright ", whose terms are:\n\n${terms}")
  else()
    string(APPEND copyright ", under that library's own terms.\n")
  endif()
endforeach()
file(CONFIGURE OUTPUT ${copyright_file} CONTENT "@copyright@" @ONLY)
install(FILES ${copyright_file} DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

# --- completions, where the shells look for those of installed programs
install(FILES share/completions/unflex.bash
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME unflex COMPONENT program)
install(FILES share/completions/unflex.fish
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
# Debian's zsh does not look into site-functions below /usr, which is the administrator's elsewhere.
install(CODE "
  set(functions site-functions)
  if(EXISTS /etc/debian_version AND CMAKE_INSTALL_PREFIX STREQUAL \"/usr\")
    set(functions vendor-completions)
  endif()
  file(INSTALL \"${PROJECT_SOURCE_DIR}/share/completions/_unflex\" DESTINATION
    \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/zsh/\${functions}\")"
  COMPONENT program)
