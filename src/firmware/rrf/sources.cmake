# Which module compiles which file of this folder (cmake/FirmwareSources.cmake).
set(sources_of_core spec.cpp)
set(sources_of_gcode arc.cpp command_settings.cpp commands.cpp effects.cpp meta.cpp reader.cpp)
set(sources_of_planner dda.cpp lookahead.cpp planner.cpp)
set(sources_of_machine config.cpp heaters.cpp steps.cpp travel.cpp)
set(sources_of_emit dialect.cpp)
