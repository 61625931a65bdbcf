# The libraries that energymargin stands on. Debian's packages of those that are missing are in energymargin_missing, and
# energymargin_missing_message says so: whoever includes this file decides whether the build can go on. The installed
# package's config includes it too, in the scope of somebody else's project, so every variable has a name of our own.

set(energymargin_missing "")

find_package(Eigen3 QUIET NO_MODULE)
if(NOT TARGET Eigen3::Eigen)
  list(APPEND energymargin_missing libeigen3-dev)
endif()

find_package(nlohmann_json QUIET)
if(NOT TARGET nlohmann_json::nlohmann_json)
  list(APPEND energymargin_missing nlohmann-json3-dev)
endif()

find_package(Threads QUIET)
if(NOT TARGET Threads::Threads)
  list(APPEND energymargin_missing libc6-dev)
endif()

# Who links the installed library does not need it.
if(NOT CMAKE_FIND_PACKAGE_NAME STREQUAL energymargin)
  find_path(energymargin_VALIJSON_INCLUDE_DIR valijson/validator.hpp)
  if(NOT energymargin_VALIJSON_INCLUDE_DIR)
    list(APPEND energymargin_missing libvalijson-dev)
  endif()
endif()

# Debian's OMPL links with -lompl alone; its own CMake files ask for parts of Boost that it does not bring.
find_path(energymargin_OMPL_INCLUDE_DIR ompl/config.h PATH_SUFFIXES ompl-1.5 ompl-1.6 ompl-1.7)
find_library(energymargin_OMPL_LIBRARY ompl)
if(energymargin_OMPL_INCLUDE_DIR AND energymargin_OMPL_LIBRARY)
  if(NOT TARGET energymargin::ompl)
    add_library(energymargin::ompl INTERFACE IMPORTED)
    set_target_properties(energymargin::ompl PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${energymargin_OMPL_INCLUDE_DIR}"
      INTERFACE_LINK_LIBRARIES "${energymargin_OMPL_LIBRARY}")
  endif()
else()
  list(APPEND energymargin_missing libompl-dev)
endif()

# The double-precision build: mixing it with the float one corrupts memory without a word.
find_path(energymargin_BULLET_INCLUDE_DIR btBulletDynamicsCommon.h PATH_SUFFIXES bullet)
set(energymargin_bullet_libraries "")
foreach(energymargin_part BulletDynamics BulletCollision LinearMath)
  find_library(energymargin_${energymargin_part}_LIBRARY ${energymargin_part}-float64)
  list(APPEND energymargin_bullet_libraries "${energymargin_${energymargin_part}_LIBRARY}")
endforeach()
if(energymargin_BULLET_INCLUDE_DIR AND NOT energymargin_bullet_libraries MATCHES "NOTFOUND")
  if(NOT TARGET energymargin::bullet)
    add_library(energymargin::bullet INTERFACE IMPORTED)
    set_target_properties(energymargin::bullet PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${energymargin_BULLET_INCLUDE_DIR}"
      INTERFACE_LINK_LIBRARIES "${energymargin_bullet_libraries}"
      INTERFACE_COMPILE_DEFINITIONS BT_USE_DOUBLE_PRECISION)
  endif()
else()
  list(APPEND energymargin_missing libbullet-dev)
endif()

list(JOIN energymargin_missing " " energymargin_missing_message)
string(CONCAT energymargin_missing_message
  "energymargin needs Debian packages that are not installed: ${energymargin_missing_message}\n"
  "  sudo apt-get install ${energymargin_missing_message}")
