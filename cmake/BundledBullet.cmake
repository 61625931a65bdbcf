include(${CMAKE_CURRENT_LIST_DIR}/Bundled.cmake)

energymargin_unpack(bullet b/bullet/bullet_3.24+dfsg.orig.tar.xz
  43c1edae2024ba18bb5d7bfd3bb2394b066a79151a29789504a2d8efcdc333d7)
set(energymargin_sources "")
foreach(energymargin_part LinearMath BulletCollision BulletDynamics)
  file(GLOB_RECURSE energymargin_found ${energymargin_bullet_SOURCE_DIR}/src/${energymargin_part}/*.cpp)
  list(APPEND energymargin_sources ${energymargin_found})
endforeach()
energymargin_bundle(bullet ${energymargin_sources})
target_include_directories(energymargin_bullet SYSTEM PUBLIC ${energymargin_bullet_SOURCE_DIR}/src)
target_compile_definitions(energymargin_bullet PUBLIC BT_USE_DOUBLE_PRECISION)
