# Which module compiles which file of this folder (cmake/FirmwareSources.cmake).
set(sources_of_core spec.cpp)
set(sources_of_gcode commands.cpp effects.cpp extended.cpp reader.cpp)
set(sources_of_planner planner.cpp)
set(sources_of_machine config.cpp config_sections.cpp generic_cartesian.cpp shaper.cpp)
set(sources_of_emit dialect.cpp)
