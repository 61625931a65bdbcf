# The installed package: find_package(energymargin) gives the target energymargin::energymargin.

include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(energymargin_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/energymargin)

install(TARGETS energymargin EXPORT energymarginTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY cpp/include/energymargin DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT energymarginTargets NAMESPACE energymargin:: DESTINATION ${energymargin_config_dir})
configure_package_config_file(cmake/energymarginConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/energymarginConfig.cmake
  INSTALL_DESTINATION ${energymargin_config_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/energymarginConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES cmake/Dependencies.cmake ${CMAKE_CURRENT_BINARY_DIR}/energymarginConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/energymarginConfigVersion.cmake DESTINATION ${energymargin_config_dir})
if(ENERGYMARGIN_APPS)
  install(TARGETS energymargin_score RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
