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
