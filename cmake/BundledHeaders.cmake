include(${CMAKE_CURRENT_LIST_DIR}/Bundled.cmake)

# The libraries that are headers alone.
energymargin_unpack(eigen e/eigen3/eigen3_3.4.0.orig.tar.bz2
  b4c198460eba6f28d34894e3a5710998818515104d6e74e5cc331ce31e46e626)
energymargin_unpack(json n/nlohmann-json3/nlohmann-json3_3.11.2.orig.tar.gz
  d69f9deb6a75e2580465c6c4c5111b89c4dc2fa94e3a85fcd2ffcd9a143d9273)

add_library(Eigen3::Eigen INTERFACE IMPORTED)
target_include_directories(Eigen3::Eigen SYSTEM INTERFACE ${energymargin_eigen_SOURCE_DIR})
add_library(nlohmann_json::nlohmann_json INTERFACE IMPORTED)
target_include_directories(nlohmann_json::nlohmann_json SYSTEM INTERFACE ${energymargin_json_SOURCE_DIR}/single_include)
