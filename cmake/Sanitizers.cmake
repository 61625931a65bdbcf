# Builds that stop at the first bad access, undefined operation or data race: docs/engineering/safety.md. All of one build has the
# same flags; Bullet, OMPL and GoogleTest come from Debian as they are.

set(ENERGYMARGIN_SANITIZE "" CACHE STRING "Sanitizers to build with: \"address;undefined\" or \"thread\"")
option(ENERGYMARGIN_FUZZ "Build the fuzz targets, which takes clang" OFF)

set(sanitizers ${ENERGYMARGIN_SANITIZE})
if(ENERGYMARGIN_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    message(FATAL_ERROR "ENERGYMARGIN_FUZZ takes clang's libFuzzer, the compiler is ${CMAKE_CXX_COMPILER_ID}: "
      "configure with -DCMAKE_CXX_COMPILER=clang++")
  endif()
  list(APPEND sanitizers fuzzer-no-link)
endif()

if(sanitizers)
  list(JOIN sanitizers "," sanitizers)
  add_compile_options(-fsanitize=${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  add_compile_definitions(_GLIBCXX_ASSERTIONS)  # indices of the standard library's containers are checked too
  add_link_options(-fsanitize=${sanitizers})
endif()
