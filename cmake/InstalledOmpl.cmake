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
