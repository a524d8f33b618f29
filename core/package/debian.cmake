# Debian packages by CPack: library, development, command line, Python module.
#   cmake --preset debian && cmake --build --preset debian && cpack --preset debian
# The packages are for one's own machines and not part of Debian. tools/upkeep/check_package debs installs, uses and removes them.
if(NOT BRISTLE_SHARED)
  message(FATAL_ERROR "bristle: BRISTLE_BUILD_DEBS needs BRISTLE_SHARED=ON: use the preset debian")
endif()
find_program(BRISTLE_DPKG_SHLIBDEPS dpkg-shlibdeps)
find_program(BRISTLE_GZIP gzip)
mark_as_advanced(BRISTLE_DPKG_SHLIBDEPS BRISTLE_GZIP)
if(NOT BRISTLE_DPKG_SHLIBDEPS OR NOT BRISTLE_GZIP)
  message(FATAL_ERROR "bristle: BRISTLE_BUILD_DEBS needs dpkg-shlibdeps (Debian: dpkg-dev) and gzip")
endif()

set(BRISTLE_DEB_MAINTAINER "The bristle authors <bristle@example.org>" CACHE STRING "Maintainer of the Debian packages")
set(BRISTLE_DEB_REVISION 1 CACHE STRING "Revision of the Debian packages")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME bristle)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${BRISTLE_DEB_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/debs)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS # whatever the umask is
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${BRISTLE_DEB_REVISION})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# Lets dpkg-shlibdeps find the library in the build folder. The dependency on its package is added by hand below.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
set(same_version "(= ${PROJECT_VERSION}-${BRISTLE_DEB_REVISION})")
set(library libbristle${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
string(JOIN "\n" model # lines of less than 80 letters
  "A contact patch is many elastic bristles that stick, bend and snap (brush"
  "model): presliding, break-away and sliding come of it, and a step stays"
  "within a given time. Kernels for SSE2, AVX2 and AVX-512 compute the same"
  "bits.")

# Documents of every package: licences and a list of changes. Header-only libraries that are compiled in ask for their
# notices, which are copied from their Debian packages on this machine.
set(documents ${PROJECT_BINARY_DIR}/package/debian)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC) # of SOURCE_DATE_EPOCH, if that is set
file(READ ${PROJECT_SOURCE_DIR}/LICENSE licence)
string(REGEX REPLACE "^MIT License\n+Copyright[^\n]*\n+" "" licence "${licence}")
string(REGEX REPLACE "\n+$" "" licence "${licence}")
string(REGEX REPLACE "\n\n" "\n.\n" licence "${licence}")
string(REGEX REPLACE "\n" "\n " licence "${licence}")

# Sets the fields of one package and installs its documents. `headers`: Debian packages of the libraries compiled in.
function(bristle_deb component package section synopsis text headers)
  string(TOUPPER ${component} COMPONENT)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  set(CPACK_DEBIAN_${COMPONENT}_PACKAGE_NAME ${package} PARENT_SCOPE)
  set(CPACK_DEBIAN_${COMPONENT}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${COMPONENT}_DESCRIPTION "${synopsis}\n${model}\n\n${text}" PARENT_SCOPE)
  set(folder ${documents}/${package})
  set(notices "")
  foreach(header IN LISTS headers)
    if(EXISTS /usr/share/doc/${header}/copyright)
      string(APPEND notices "\n copyright-${header}")
      configure_file(/usr/share/doc/${header}/copyright ${folder}/copyright-${header} COPYONLY)
      install(FILES ${folder}/copyright-${header} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
    endif()
  endforeach()
  if(notices)
    set(notices "Comment: code of header-only libraries is compiled in; the notices of each are beside this file:${notices}\n")
  endif()
  configure_file(core/package/debian_copyright.in ${folder}/copyright @ONLY)
  configure_file(core/package/debian_changelog.in ${folder}/changelog.Debian @ONLY)
  execute_process(COMMAND ${BRISTLE_GZIP} -9nf ${folder}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${folder}/copyright ${folder}/changelog.Debian.gz
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endfunction()

set(CPACK_COMPONENTS_ALL "")
bristle_deb(bristle_runtime ${library} libs "friction of contact patches against a deadline - library"
  "This package has the shared library." "libxsimd-dev")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
file(CONFIGURE OUTPUT ${documents}/triggers CONTENT "activate-noawait ldconfig\n" @ONLY)
set(CPACK_DEBIAN_BRISTLE_RUNTIME_PACKAGE_CONTROL_EXTRA ${documents}/triggers)

bristle_deb(bristle_development libbristle-dev libdevel "friction of contact patches against a deadline - headers"
  "This package has headers for C and C++, and what CMake and pkg-config need." "")
set(CPACK_DEBIAN_BRISTLE_DEVELOPMENT_PACKAGE_DEPENDS "${library} ${same_version}")
set(CPACK_DEBIAN_BRISTLE_DEVELOPMENT_PACKAGE_SUGGESTS "libeigen3-dev (>= 3.4)")
set(CPACK_DEBIAN_BRISTLE_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)

if(TARGET bristle_cli)
  bristle_deb(bristle_tools bristle-tools science "friction of contact patches against a deadline - command line"
    "This package has the program bristle: it runs scenes, fits materials to\nmeasured friction, repeats the classic experiments, and measures how many\nbristles a machine steps in time."
    "libcli11-dev;libeigen3-dev;libfccp-dev;libtomlplusplus-dev;nlohmann-json3-dev")
  set(CPACK_DEBIAN_BRISTLE_TOOLS_PACKAGE_DEPENDS "${library} ${same_version}")
  set(CPACK_DEBIAN_BRISTLE_TOOLS_PACKAGE_SUGGESTS gnuplot-nox)
endif()

if(TARGET bristle_python)
  bristle_deb(python python3-bristle python "friction of contact patches against a deadline - Python module"
    "This package has the Python module, over arrays of numpy."
    "libeigen3-dev;libfccp-dev;libtomlplusplus-dev;nlohmann-json3-dev;pybind11-dev")
  # The module fits one version of Python. Its byte code is made after installing and removed before the module.
  math(EXPR next_python "${BRISTLE_PYTHON_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${library} ${same_version}, python3-numpy (>= 1:1.20), \
python3 (>= 3.${BRISTLE_PYTHON_VERSION_MINOR}), python3 (<< 3.${next_python})")
  file(CONFIGURE OUTPUT ${documents}/postinst CONTENT
    "#!/bin/sh\nset -e\nif [ \"$1\" = configure ]; then\n  py3compile -p python3-bristle\nfi\n" @ONLY)
  file(CONFIGURE OUTPUT ${documents}/prerm CONTENT "#!/bin/sh\nset -e\npy3clean -p python3-bristle\n" @ONLY)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${documents}/postinst;${documents}/prerm")
endif()
include(CPack)
