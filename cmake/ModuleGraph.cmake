# Writes which module links which to modules.txt in the build directory, a line for each module with
# those that it links. docs/draw_modules.py makes docs/modules.svg of it.
set(module_graph "")
foreach(module IN LISTS UNFLEX_MODULES)
  get_target_property(links unflex_${module} LINK_LIBRARIES)
  list(FILTER links INCLUDE REGEX "^unflex::")
  list(TRANSFORM links REPLACE "^unflex::" "")
  list(SORT links)
  list(JOIN links " " links)
  string(STRIP "${module} ${links}" line)
  string(APPEND module_graph "${line}\n")
endforeach()
file(WRITE ${PROJECT_BINARY_DIR}/modules.txt "${module_graph}")
