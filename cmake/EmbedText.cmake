# Makes text files constants of the program.
#
# unflex_embed_text(target FILE... ) makes a source of `target` in which each file is a
# std::string_view: assets/page.css of unflex_report becomes unflex::report::assets::page_css. The
# module declares its constants in its header assets.hpp. The source is made anew whenever a file
# changes.
#
# Run as a script, with OUTPUT, MODULE and FILES (separated by |), this writes that source.
if(CMAKE_SCRIPT_MODE_FILE)
  string(REPLACE "|" ";" files "${FILES}")
  set(source "#include \"assets.hpp\"\n\nnamespace unflex::${MODULE}::assets {\n")
  foreach(file IN LISTS files)
    get_filename_component(name "${file}" NAME)
    string(REPLACE "." "_" name "${name}")
    file(READ "${file}" text)
    string(APPEND source
      "\nextern const std::string_view ${name} = R\"unflex(${text})unflex\";\n")
  endforeach()
  string(APPEND source "\n}  // namespace unflex::${MODULE}::assets\n")
  file(WRITE "${OUTPUT}" "${source}")
  return()
endif()

set(UNFLEX_EMBED_TEXT_SCRIPT ${CMAKE_CURRENT_LIST_FILE})
function(unflex_embed_text target)
  list(TRANSFORM ARGN PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/" OUTPUT_VARIABLE files)
  string(REPLACE ";" "|" joined "${files}")
  string(REPLACE unflex_ "" module ${target})
  set(output ${CMAKE_CURRENT_BINARY_DIR}/assets.cpp)
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} "-DOUTPUT=${output}" "-DMODULE=${module}" "-DFILES=${joined}" -P
            ${UNFLEX_EMBED_TEXT_SCRIPT}
    DEPENDS ${files} ${UNFLEX_EMBED_TEXT_SCRIPT} VERBATIM)
  target_sources(${target} PRIVATE ${output})
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
endfunction()
