include(${CMAKE_CURRENT_LIST_DIR}/Bundled.cmake)

# OMPL without the parts that need a library of Boost: the headers are enough for the others.
find_package(Boost REQUIRED)
energymargin_unpack(ompl o/ompl/ompl_1.5.2+ds1.orig.tar.xz
  e4d96102042ceac67e376111ebe5767c1c7146c45506169250279ac066de93fb)
set(energymargin_root ${energymargin_ompl_SOURCE_DIR}/src/ompl)
set(energymargin_sources "")
foreach(energymargin_part base control datastructures geometric tools util)
  file(GLOB_RECURSE energymargin_found ${energymargin_root}/${energymargin_part}/*.cpp)
  list(APPEND energymargin_sources ${energymargin_found})
endforeach()
list(FILTER energymargin_sources EXCLUDE REGEX
  "/(benchmark|experience|lightning|ltl|multilevel|quotientspace|thunder|xxl)/|/(PlannerData|PlannerDataStorage|StateStorage)\\.cpp$")

# PlannerData.cpp without the one function that needs the state storage, and so Boost's serialization.
set(energymargin_planner_data ${CMAKE_CURRENT_BINARY_DIR}/bundled/PlannerData.cpp)
file(READ ${energymargin_root}/base/src/PlannerData.cpp energymargin_text)
string(FIND "${energymargin_text}" "ompl::base::StateStoragePtr ompl::base::PlannerData::extractStateStorage" energymargin_begin)
string(FIND "${energymargin_text}" "ompl::base::PlannerData::Graph &ompl::base::PlannerData::toBoostGraph" energymargin_end)
string(SUBSTRING "${energymargin_text}" 0 ${energymargin_begin} energymargin_before)
string(SUBSTRING "${energymargin_text}" ${energymargin_end} -1 energymargin_after)
file(CONFIGURE OUTPUT ${energymargin_planner_data} CONTENT "${energymargin_before}${energymargin_after}" @ONLY)

block()
  set(PROJECT_VERSION_MAJOR 1)
  set(PROJECT_VERSION_MINOR 5)
  set(PROJECT_VERSION_PATCH 2)
  configure_file(${energymargin_root}/config.h.in ${CMAKE_CURRENT_BINARY_DIR}/bundled/ompl/config.h)
endblock()

energymargin_bundle(ompl ${energymargin_sources} ${energymargin_planner_data})
target_include_directories(energymargin_ompl SYSTEM PUBLIC ${energymargin_ompl_SOURCE_DIR}/src
  ${CMAKE_CURRENT_BINARY_DIR}/bundled ${Boost_INCLUDE_DIRS})
target_link_libraries(energymargin_ompl PUBLIC Eigen3::Eigen Threads::Threads)
