# Compiles through ccache where that is installed and no other launcher is asked for.
#
# Paths below the checkout are made relative, so that a checkout in another folder finds what this one
# has compiled. The leniency is the one that ccache's manual asks for with precompiled headers.
find_program(UNFLEX_CCACHE ccache)
mark_as_advanced(UNFLEX_CCACHE)
if(UNFLEX_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_DEPEND=true CCACHE_NOHASHDIR=true
    CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    ${UNFLEX_CCACHE})
endif()
