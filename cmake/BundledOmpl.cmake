include(${CMAKE_CURRENT_LIST_DIR}/Bundled.cmake)

# Of OMPL the planners that are used here, what they need, and what OMPL chooses from if it is asked for any planner;
# nothing that needs a library of Boost.
find_package(Boost REQUIRED)
energymargin_unpack(ompl o/ompl/ompl_1.5.2+ds1.orig.tar.xz
  e4d96102042ceac67e376111ebe5767c1c7146c45506169250279ac066de93fb)
set(energymargin_ompl_root ${energymargin_ompl_SOURCE_DIR}/src/ompl)
file(GLOB_RECURSE energymargin_ompl_sources ${energymargin_ompl_root}/base/*.cpp ${energymargin_ompl_root}/control/*.cpp
  ${energymargin_ompl_root}/datastructures/*.cpp ${energymargin_ompl_root}/geometric/*.cpp ${energymargin_ompl_root}/tools/*.cpp ${energymargin_ompl_root}/util/*.cpp)
list(FILTER energymargin_ompl_sources EXCLUDE REGEX "/(ltl|quotientspace|xxl|experience|lightning|thunder|benchmark|multilevel)/|(PlannerDataStorage|StateStorage)\\.cpp$")
energymargin_bundle(ompl ${energymargin_ompl_sources})
block()
  set(PROJECT_VERSION_MAJOR 1)
  set(PROJECT_VERSION_MINOR 5)
  set(PROJECT_VERSION_PATCH 2)
  configure_file(${energymargin_ompl_root}/config.h.in ${CMAKE_CURRENT_BINARY_DIR}/bundled/ompl/config.h)
endblock()
target_include_directories(energymargin_ompl SYSTEM PUBLIC ${energymargin_ompl_SOURCE_DIR}/src
  ${CMAKE_CURRENT_BINARY_DIR}/bundled ${Boost_INCLUDE_DIRS})
target_link_libraries(energymargin_ompl PUBLIC Eigen3::Eigen Threads::Threads)
