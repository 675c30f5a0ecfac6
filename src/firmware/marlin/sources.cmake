# Which module compiles which file of this folder (cmake/FirmwareSources.cmake).
set(sources_of_core spec.cpp)
set(sources_of_gcode arc.cpp commands.cpp effects.cpp reader.cpp)
set(sources_of_planner block.cpp junction.cpp planner.cpp trapezoid.cpp)
set(sources_of_machine dump.cpp)
set(sources_of_emit dialect.cpp)
