# What gets installed. Component "python" is the wheel's; component "development" is the C++ package, with which
# find_package(energymargin) gives the target energymargin::energymargin:
#   cmake --install build --component development --prefix DIR

include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

if(ENERGYMARGIN_PYTHON)
  install(TARGETS _core DESTINATION energymargin COMPONENT python)
  install(FILES cpp/src/problem_io/problem.schema.json DESTINATION energymargin COMPONENT python)
  install(FILES data/three_finger_gripper.urdf DESTINATION energymargin/data COMPONENT python)
  install(DIRECTORY data/push_real DESTINATION energymargin/data COMPONENT python FILES_MATCHING PATTERN "*.json" PATTERN "*.csv")
endif()
if(SKBUILD)
  install(TARGETS energymargin_score RUNTIME DESTINATION ${SKBUILD_SCRIPTS_DIR} COMPONENT python)
elseif(ENERGYMARGIN_APPS)
  install(TARGETS energymargin_score RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT development)
endif()

# A bundled part of a static library is none of its own: there is no package of such a build.
if(ENERGYMARGIN_BUNDLE AND NOT BUILD_SHARED_LIBS)
  return()
endif()

set(energymargin_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/energymargin)
install(TARGETS energymargin EXPORT energymarginTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(DIRECTORY cpp/include/energymargin DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(FILES cpp/src/problem_io/problem.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/energymargin
  COMPONENT development)
install(EXPORT energymarginTargets NAMESPACE energymargin:: DESTINATION ${energymargin_config_dir} COMPONENT development)
configure_package_config_file(cmake/energymarginConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/energymarginConfig.cmake
  INSTALL_DESTINATION ${energymargin_config_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/energymarginConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES cmake/Dependencies.cmake cmake/InstalledBullet.cmake cmake/InstalledOmpl.cmake ${CMAKE_CURRENT_BINARY_DIR}/energymarginConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/energymarginConfigVersion.cmake DESTINATION ${energymargin_config_dir} COMPONENT development)
