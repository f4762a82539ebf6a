# find_package(ndmap) for programs outside this tree: the target ndmap::sdk. docs/sdk.md tells how.
include(CMakePackageConfigHelpers)
set(NDMAP_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/ndmap)
configure_package_config_file(cmake/ndmap-config.cmake.in ndmap-config.cmake INSTALL_DESTINATION ${NDMAP_PACKAGE_DIR}
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(ndmap-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ndmap-config.cmake ${PROJECT_BINARY_DIR}/ndmap-config-version.cmake
  DESTINATION ${NDMAP_PACKAGE_DIR} COMPONENT sdk)
install(EXPORT ndmap-targets NAMESPACE ndmap:: DESTINATION ${NDMAP_PACKAGE_DIR} COMPONENT sdk)
