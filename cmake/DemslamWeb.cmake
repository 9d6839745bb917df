# The report page (docs/report.md): web/ is copied into the build folder, its packages are installed there by `npm ci`
# (package-lock.json pins them) and Vite makes one HTML file of it, DEMSLAM_PAGE_FILE, which the library takes in. Where
# that cannot be done, demslam is built all the same: `demslam report` then writes *.png and says why there is no page.
option(DEMSLAM_WEB "Build the report page into demslam (needs npm)" ON)
find_program(DEMSLAM_NPM npm)
find_program(DEMSLAM_NODE node)
if(DEMSLAM_WEB AND NOT (DEMSLAM_NPM AND DEMSLAM_NODE))
  message(WARNING "npm or node is missing: demslam is built without its report page (*.html); scripts/setup installs them")
  set(DEMSLAM_WEB OFF)
endif()
if(NOT DEMSLAM_WEB)
  message(STATUS "no report page in this build: `demslam report` writes *.png alone")
  return()
endif()

set(web_source ${PROJECT_SOURCE_DIR}/web)
set(web_build ${CMAKE_BINARY_DIR}/web)
set(DEMSLAM_PAGE_FILE ${web_build}/page.html)
file(GLOB_RECURSE web_files CONFIGURE_DEPENDS ${web_source}/src/*)
list(APPEND web_files ${web_source}/index.html ${web_source}/vite.config.ts ${web_source}/tsconfig.json
     ${web_source}/package.json ${web_source}/package-lock.json)
add_custom_command(
  OUTPUT ${DEMSLAM_PAGE_FILE}
  COMMAND ${CMAKE_COMMAND} -DNPM=${DEMSLAM_NPM} -DSOURCE=${web_source} -DBUILD=${web_build}
          -P ${PROJECT_SOURCE_DIR}/cmake/BuildPage.cmake
  DEPENDS ${web_files} ${PROJECT_SOURCE_DIR}/cmake/BuildPage.cmake
  COMMENT "Building the report page" VERBATIM)
add_custom_target(demslam_page DEPENDS ${DEMSLAM_PAGE_FILE})
