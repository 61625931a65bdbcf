# The libraries that energymargin stands on, each looked for before anything is said, so that one message names all that
# is missing. Also used by the installed package's config.

set(energymargin_missing "")

find_package(Eigen3 QUIET NO_MODULE)
if(NOT TARGET Eigen3::Eigen)
  list(APPEND energymargin_missing libeigen3-dev)
endif()

find_package(nlohmann_json QUIET)
if(NOT TARGET nlohmann_json::nlohmann_json)
  list(APPEND energymargin_missing nlohmann-json3-dev)
endif()

# Who links the installed library does not need it.
if(NOT CMAKE_FIND_PACKAGE_NAME STREQUAL energymargin)
  find_path(VALIJSON_INCLUDE_DIR valijson/validator.hpp)
  if(NOT VALIJSON_INCLUDE_DIR)
    list(APPEND energymargin_missing libvalijson-dev)
  endif()
endif()

# Debian's OMPL links with -lompl alone; its own CMake files ask for parts of Boost that it does not bring.
find_path(OMPL_INCLUDE_DIR ompl/config.h PATH_SUFFIXES ompl-1.5 ompl-1.6 ompl-1.7)
find_library(OMPL_LIBRARY ompl)
if(OMPL_INCLUDE_DIR AND OMPL_LIBRARY)
  if(NOT TARGET energymargin::ompl)
    add_library(energymargin::ompl INTERFACE IMPORTED)
    set_target_properties(energymargin::ompl PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES ${OMPL_INCLUDE_DIR} INTERFACE_LINK_LIBRARIES ${OMPL_LIBRARY})
  endif()
else()
  list(APPEND energymargin_missing libompl-dev)
endif()

# The double-precision build: mixing it with the float one corrupts memory without a word.
find_path(BULLET_INCLUDE_DIR btBulletDynamicsCommon.h PATH_SUFFIXES bullet)
foreach(part BulletDynamics BulletCollision LinearMath)
  find_library(${part}_LIBRARY ${part}-float64)
  list(APPEND BULLET_LIBRARIES ${${part}_LIBRARY})
endforeach()
if(BULLET_INCLUDE_DIR AND BulletDynamics_LIBRARY AND BulletCollision_LIBRARY AND LinearMath_LIBRARY)
  if(NOT TARGET energymargin::bullet)
    add_library(energymargin::bullet INTERFACE IMPORTED)
    set_target_properties(energymargin::bullet PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES ${BULLET_INCLUDE_DIR} INTERFACE_LINK_LIBRARIES "${BULLET_LIBRARIES}"
      INTERFACE_COMPILE_DEFINITIONS BT_USE_DOUBLE_PRECISION)
  endif()
else()
  list(APPEND energymargin_missing libbullet-dev)
endif()

if(energymargin_missing)
  list(JOIN energymargin_missing " " energymargin_missing)
  message(FATAL_ERROR "energymargin needs Debian packages that are not installed: ${energymargin_missing}\n"
    "  sudo apt-get install ${energymargin_missing}")
endif()

find_package(Threads REQUIRED)
