option(DEMSLAM_BUILD_TESTS "Build the tests" ON)
option(DEMSLAM_BUILD_BENCHMARKS "Build the benchmarks" OFF)
set(DEMSLAM_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them (address,undefined or thread)")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

# Warnings and sanitizers belong to this build, not to those who link the installed library.
add_library(demslam_build_flags INTERFACE)
target_compile_options(demslam_build_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-maybe-uninitialized -Wno-missing-field-initializers)
# Never -march here: Eigen's alignment is part of GTSAM's ABI (docs/architecture.md, "Eigen's ABI").
target_compile_options(demslam_build_flags INTERFACE -ffp-contract=off)
if(DEMSLAM_SANITIZE)
  target_compile_options(demslam_build_flags INTERFACE -fsanitize=${DEMSLAM_SANITIZE} -fno-omit-frame-pointer
                                                       -fno-sanitize-recover=all)
  target_link_options(demslam_build_flags INTERFACE -fsanitize=${DEMSLAM_SANITIZE})
  if(DEMSLAM_SANITIZE MATCHES "address")
    target_compile_definitions(demslam_build_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  endif()
endif()
