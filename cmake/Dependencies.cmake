# The libraries that energymargin stands on. Debian's packages of those that are missing are in energymargin_missing, and
# energymargin_missing_message says so: whoever includes this file decides whether the build can go on. The installed
# package's config includes it too, in the scope of somebody else's project, so every variable has a name of our own.

set(energymargin_missing "")

# Which of them are needed: all to build the library, fewer to link a static one, and fewest a shared one.
if(NOT CMAKE_FIND_PACKAGE_NAME STREQUAL energymargin)
  set(energymargin_needs eigen threads ompl json bullet)
  if(ENERGYMARGIN_TESTS)
    list(APPEND energymargin_needs valijson)
  endif()
elseif(energymargin_SHARED)
  set(energymargin_needs eigen threads ompl)
else()
  set(energymargin_needs eigen threads ompl json bullet)
endif()

if("headers" IN_LIST ENERGYMARGIN_BUNDLE)
  include(${CMAKE_CURRENT_LIST_DIR}/BundledHeaders.cmake)
endif()

if(NOT TARGET Eigen3::Eigen)
  find_package(Eigen3 QUIET NO_MODULE)
endif()
if(NOT TARGET Eigen3::Eigen)
  list(APPEND energymargin_missing libeigen3-dev)
endif()

find_package(Threads QUIET)
if(NOT TARGET Threads::Threads)
  list(APPEND energymargin_missing libc6-dev)
endif()

if("json" IN_LIST energymargin_needs)
  if(NOT TARGET nlohmann_json::nlohmann_json)
    find_package(nlohmann_json QUIET)
  endif()
  if(NOT TARGET nlohmann_json::nlohmann_json)
    list(APPEND energymargin_missing nlohmann-json3-dev)
  endif()
endif()

if("valijson" IN_LIST energymargin_needs)
  find_path(energymargin_VALIJSON_INCLUDE_DIR valijson/validator.hpp)
  if(NOT energymargin_VALIJSON_INCLUDE_DIR)
    list(APPEND energymargin_missing libvalijson-dev)
  endif()
endif()

foreach(energymargin_engine Ompl Bullet)
  string(TOLOWER ${energymargin_engine} energymargin_name)
  if(energymargin_name IN_LIST ENERGYMARGIN_BUNDLE)
    include(${CMAKE_CURRENT_LIST_DIR}/Bundled${energymargin_engine}.cmake)
  elseif(energymargin_name IN_LIST energymargin_needs)
    include(${CMAKE_CURRENT_LIST_DIR}/Installed${energymargin_engine}.cmake)
  endif()
endforeach()

list(JOIN energymargin_missing " " energymargin_missing_message)
string(CONCAT energymargin_missing_message
  "energymargin needs Debian packages that are not installed: ${energymargin_missing_message}\n"
  "  sudo apt-get install ${energymargin_missing_message}")
