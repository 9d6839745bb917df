# cmake --install gives a find_package(demslam) with the target demslam::demslam (examples/minimal links it).
include(CMakePackageConfigHelpers)
set(DEMSLAM_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/demslam)

get_property(modules GLOBAL PROPERTY DEMSLAM_MODULES)
install(TARGETS demslam ${modules} EXPORT demslam-targets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT demslam-targets NAMESPACE demslam:: DESTINATION ${DEMSLAM_CMAKE_DIR})
install(DIRECTORY src/demslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h" PATTERN "internal" EXCLUDE)
install(FILES cmake/FindGTSAM.cmake cmake/FindONNXRuntime.cmake cmake/DemslamDependencies.cmake
        DESTINATION ${DEMSLAM_CMAKE_DIR})
install(FILES LICENSE NOTICE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY configs DESTINATION ${CMAKE_INSTALL_DATADIR}/demslam)

configure_package_config_file(cmake/demslam-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/demslam-config.cmake
                              INSTALL_DESTINATION ${DEMSLAM_CMAKE_DIR})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/demslam-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/demslam-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/demslam-config-version.cmake
        DESTINATION ${DEMSLAM_CMAKE_DIR})
