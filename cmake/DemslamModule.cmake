# demslam_module(NAME [DEPENDS module...] [PUBLIC library...] [PRIVATE library...] [PRECOMPILE header...])
#
# One folder src/demslam/NAME = one target demslam_NAME (demslam::NAME for those who install).
# Sources are every *.cpp of the folder; *_test.cpp go into the test program demslam_NAME_test.
# DEPENDS names modules of lower floors (tests/architecture checks the includes against the floors).
# PRECOMPILE names headers of a library that take long to read; every source still includes what it uses.
function(demslam_module NAME)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PUBLIC;PRIVATE;PRECOMPILE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${NAME}/*.cpp)
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$")
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  list(TRANSFORM ARG_DEPENDS PREPEND demslam_)

  set(target demslam_${NAME})
  if(sources)
    add_library(${target} STATIC ${sources})
    target_link_libraries(${target} PUBLIC ${ARG_DEPENDS} ${ARG_PUBLIC}
                                    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:demslam_build_flags>)
    demslam_precompile(${target} ${ARG_PRECOMPILE})
    set(scope PUBLIC)
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE ${ARG_DEPENDS} ${ARG_PUBLIC})
    set(scope INTERFACE)
  endif()
  add_library(demslam::${NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${NAME})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
                                                $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  set_property(GLOBAL APPEND PROPERTY DEMSLAM_MODULES ${target})

  if(DEMSLAM_BUILD_TESTS AND tests)
    demslam_test(${target}_test SOURCES ${tests} LIBRARIES ${target} ${ARG_PRIVATE})
    demslam_precompile(${target}_test ${ARG_PRECOMPILE})
  endif()
endfunction()

# Not under clang-tidy, which cannot read GCC's precompiled headers. -fpch-preprocess lets ccache see through them.
function(demslam_precompile target)
  if(ARGN AND NOT CMAKE_CXX_CLANG_TIDY)
    target_precompile_headers(${target} PRIVATE ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
  endif()
endfunction()

# demslam_test(NAME SOURCES file... LIBRARIES target... [FIXTURE name]): one GoogleTest program, each TEST a ctest entry.
function(demslam_test NAME)
  cmake_parse_arguments(ARG "" "FIXTURE" "SOURCES;LIBRARIES" ${ARGN})
  find_package(GTest REQUIRED)
  include(GoogleTest)
  if(NOT TARGET demslam_test_main)
    add_library(demslam_test_main OBJECT "${PROJECT_SOURCE_DIR}/tests/test_main.cpp")
    target_link_libraries(demslam_test_main PUBLIC GTest::gtest GTest::gmock PRIVATE demslam_build_flags)
  endif()
  add_executable(${NAME} ${ARG_SOURCES})
  target_link_libraries(${NAME} PRIVATE ${ARG_LIBRARIES} demslam_test_main demslam_build_flags)
  target_compile_definitions(${NAME} PRIVATE
    DEMSLAM_SOURCE_DIR="${PROJECT_SOURCE_DIR}" DEMSLAM_SHARED_DIR="${DEMSLAM_SHARED_DIR}")
  gtest_discover_tests(${NAME} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT 600 FIXTURES_REQUIRED "${ARG_FIXTURE}")
endfunction()

set(DEMSLAM_SHARED_DIR "${PROJECT_SOURCE_DIR}/../shared" CACHE PATH
    "Folder with the reference models/ and data/ that some tests read (skipped where missing)")
enable_testing()
