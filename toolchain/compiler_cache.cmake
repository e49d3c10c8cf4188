# ccache when it is installed: a second build folder, or a clean build, takes seconds instead of minutes. Another launcher
# (or none: -DCMAKE_CXX_COMPILER_LAUNCHER=) can be given.
if(NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(CCACHE ccache)
  if(CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
  endif()
endif()
