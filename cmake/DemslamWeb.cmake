# The report page (docs/report.md): web/ is copied into the build folder, its packages are installed there by `npm ci`
# (package-lock.json pins them) and Vite makes one HTML file of it, DEMSLAM_PAGE_FILE, which the library takes in.
option(DEMSLAM_WEB "Build the report page into demslam (needs npm)" ON)
if(NOT DEMSLAM_WEB)
  message(STATUS "DEMSLAM_WEB is off: `demslam report` writes *.png alone")
  return()
endif()
find_program(DEMSLAM_NPM npm)
if(NOT DEMSLAM_NPM)
  message(FATAL_ERROR "npm is missing: run scripts/setup, or configure with -DDEMSLAM_WEB=OFF to go without the report page")
endif()

set(web_source ${PROJECT_SOURCE_DIR}/web)
set(web_build ${CMAKE_BINARY_DIR}/web)
set(DEMSLAM_PAGE_FILE ${web_build}/dist/index.html)

add_custom_command(
  OUTPUT ${web_build}/packages.stamp
  COMMAND ${CMAKE_COMMAND} -E make_directory ${web_build}
  COMMAND ${CMAKE_COMMAND} -E copy ${web_source}/package.json ${web_source}/package-lock.json ${web_build}
  COMMAND ${CMAKE_COMMAND} -E chdir ${web_build} ${DEMSLAM_NPM} ci --silent --no-audit --no-fund --prefer-offline
  COMMAND ${CMAKE_COMMAND} -E touch ${web_build}/packages.stamp
  DEPENDS ${web_source}/package.json ${web_source}/package-lock.json
  COMMENT "Installing the packages of the report page" VERBATIM)

file(GLOB_RECURSE web_files CONFIGURE_DEPENDS ${web_source}/src/* ${web_source}/test/*)
list(APPEND web_files ${web_source}/index.html ${web_source}/vite.config.ts ${web_source}/tsconfig.json)
add_custom_command(
  OUTPUT ${DEMSLAM_PAGE_FILE}
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${web_build}/src ${web_build}/test
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${web_source}/src ${web_build}/src
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${web_source}/test ${web_build}/test
  COMMAND ${CMAKE_COMMAND} -E copy ${web_source}/index.html ${web_source}/vite.config.ts ${web_source}/tsconfig.json ${web_build}
  COMMAND ${CMAKE_COMMAND} -E chdir ${web_build} ${DEMSLAM_NPM} run --silent build
  DEPENDS ${web_build}/packages.stamp ${web_files}
  COMMENT "Building the report page" VERBATIM)
add_custom_target(demslam_page DEPENDS ${DEMSLAM_PAGE_FILE})
