# Debian's GTSAM export names an archive that is not packaged; this module finds the library itself.
# Target: GTSAM::GTSAM
find_path(GTSAM_INCLUDE_DIR gtsam/config.h)
find_library(GTSAM_LIBRARY gtsam)
find_library(GTSAM_METIS_LIBRARY metis)
find_library(GTSAM_TBBMALLOC_LIBRARY tbbmalloc)
find_package(Eigen3 QUIET NO_MODULE)
find_package(TBB QUIET)
find_package(Boost QUIET COMPONENTS serialization timer CONFIG)
if(GTSAM_INCLUDE_DIR)
  file(STRINGS ${GTSAM_INCLUDE_DIR}/gtsam/config.h _gtsam_version REGEX "define GTSAM_VERSION_STRING")
  string(REGEX REPLACE ".*\"([0-9.]+).*" "\\1" GTSAM_VERSION "${_gtsam_version}")
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(GTSAM REQUIRED_VARS GTSAM_LIBRARY GTSAM_INCLUDE_DIR GTSAM_METIS_LIBRARY
                                  GTSAM_TBBMALLOC_LIBRARY Eigen3_FOUND TBB_FOUND Boost_FOUND VERSION_VAR GTSAM_VERSION)
if(GTSAM_FOUND AND NOT TARGET GTSAM::GTSAM)
  add_library(GTSAM::GTSAM UNKNOWN IMPORTED)
  set_target_properties(GTSAM::GTSAM PROPERTIES IMPORTED_LOCATION ${GTSAM_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${GTSAM_INCLUDE_DIR})
  target_link_libraries(GTSAM::GTSAM INTERFACE Eigen3::Eigen TBB::tbb ${GTSAM_TBBMALLOC_LIBRARY}
                        ${GTSAM_METIS_LIBRARY} Boost::serialization Boost::timer)
endif()
mark_as_advanced(GTSAM_INCLUDE_DIR GTSAM_LIBRARY GTSAM_METIS_LIBRARY GTSAM_TBBMALLOC_LIBRARY)
