# Installs the built package into a fresh prefix, builds a program against it with find_package, and runs it. Then looks
# for the package where one of its own packages is missing.

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# What find_package(energymargin HOW) says without Eigen and nlohmann-json, and whether the project goes on.
function(configure_incomplete how result output)
  execute_process(COMMAND ${CMAKE_COMMAND} --no-warn-unused-cli -S ${CMAKE_CURRENT_LIST_DIR}/incomplete -B ${WORK}/incomplete-${how}
    -DCMAKE_PREFIX_PATH=${WORK}/prefix -DHOW=${how} -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_nlohmann_json=ON
    RESULT_VARIABLE exit_code OUTPUT_VARIABLE text ERROR_VARIABLE text)
  set(${result} ${exit_code} PARENT_SCOPE)
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --component development --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)
if(EXISTS ${WORK}/build/consumer_avx2)
  run(${WORK}/build/consumer_avx2)
endif()

# The examples print what stands beside them. All but 04 do in Python too (tests/python/house/test_examples.py).
set(root ${CMAKE_CURRENT_LIST_DIR}/../../..)
foreach(example 01_capture 02_effort 03_own_scene 04_own_planner 13_grip 14_cage)
  set(problem "")
  if(example MATCHES "capture|effort")
    set(problem ${root}/tests/golden/problem-grasp.json)
  endif()
  execute_process(COMMAND ${WORK}/build/${example} ${problem} OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
  file(READ ${root}/examples/${example}.txt expected)
  if(NOT printed STREQUAL expected)
    message(FATAL_ERROR "${example} prints:\n${printed}\nexpected:\n${expected}")
  endif()
endforeach()

# A shared library needs no package that its headers do not include.
file(STRINGS ${BUILD}/CMakeCache.txt shared REGEX "^BUILD_SHARED_LIBS:BOOL=ON$")
set(missing "sudo apt-get install libeigen3-dev nlohmann-json3-dev\n")
if(shared)
  set(missing "sudo apt-get install libeigen3-dev\n")
endif()
configure_incomplete(QUIET result output)
if(NOT result EQUAL 0 OR NOT output MATCHES "without energymargin: .*${missing}" OR output MATCHES "Warning")
  message(FATAL_ERROR "find_package(energymargin QUIET) ended with ${result}:\n${output}")
endif()
configure_incomplete(REQUIRED result output)
if(result EQUAL 0 OR NOT output MATCHES "${missing}" OR output MATCHES "without energymargin")
  message(FATAL_ERROR "find_package(energymargin REQUIRED) ended with ${result}:\n${output}")
endif()
