# HTML of the public headers: target bristle_docs, in docs/html of the build folder.
find_package(Doxygen QUIET)
if(NOT DOXYGEN_FOUND)
  bristle_skip("the HTML of the public headers" doxygen)
  return()
endif()
configure_file(core/package/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
add_custom_target(bristle_docs COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile
  COMMENT "HTML of the public headers: ${PROJECT_BINARY_DIR}/docs/html/index.html" VERBATIM)
