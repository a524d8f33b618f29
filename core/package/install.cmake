# Installs library, headers, CMake package and pkg-config file. All installed files may be moved to another prefix.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

if(BRISTLE_SHARED)
  set(kind shared)
else()
  set(kind static)
endif()
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/bristle)

install(TARGETS bristle EXPORT bristle-${kind}
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT bristle_runtime
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT bristle_runtime NAMELINK_COMPONENT bristle_development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT bristle_development
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT bristle_development)
# Static and shared library have separate files of targets, so that both may be installed in one prefix.
install(EXPORT bristle-${kind} FILE bristle-${kind}-targets.cmake NAMESPACE bristle::
  DESTINATION ${package_dir} COMPONENT bristle_development)
if(TARGET bristle_eigen)
  set_target_properties(bristle_eigen PROPERTIES EXPORT_NAME eigen)
  install(TARGETS bristle_eigen EXPORT bristle-eigen
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT bristle_development)
  install(EXPORT bristle-eigen FILE bristle-eigen-targets.cmake NAMESPACE bristle::
    DESTINATION ${package_dir} COMPONENT bristle_development)
endif()

set(bristle_cxx_runtime ${CMAKE_CXX_IMPLICIT_LINK_LIBRARIES})
list(FILTER bristle_cxx_runtime INCLUDE REGEX "^(stdc\\+\\+|c\\+\\+)$")
list(REMOVE_DUPLICATES bristle_cxx_runtime)
configure_package_config_file(core/package/bristle-config.cmake.in ${PROJECT_BINARY_DIR}/package/bristle-config.cmake
  INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/bristle-config-version.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/package/bristle-config.cmake
  ${PROJECT_BINARY_DIR}/package/bristle-config-version.cmake
  DESTINATION ${package_dir} COMPONENT bristle_development)

# Lets pkg-config derive the prefix from the folder of its file, unless the folder of libraries is an absolute path.
set(pc_private_libs "")
if(BRISTLE_WITH_TBB)
  string(APPEND pc_private_libs " -ltbb")
endif()
foreach(library IN LISTS bristle_cxx_runtime)
  string(APPEND pc_private_libs " -l${library}")
endforeach()
string(APPEND pc_private_libs " -lm")
set(pc_static_flags "")
set(pc_static_libs "")
if(NOT BRISTLE_SHARED)
  set(pc_static_flags " -DBRISTLE_STATIC")
  set(pc_static_libs "${pc_private_libs}")
endif()
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(pc_prefix ${CMAKE_INSTALL_PREFIX})
  set(pc_libdir ${CMAKE_INSTALL_LIBDIR})
else()
  file(RELATIVE_PATH up /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
  string(REGEX REPLACE "/$" "" up "${up}")
  set(pc_prefix "\${pcfiledir}/${up}")
  set(pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
endif()
set(pc_includedir ${CMAKE_INSTALL_INCLUDEDIR})
if(NOT IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
  set(pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(core/package/bristle.pc.in ${PROJECT_BINARY_DIR}/package/bristle.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/package/bristle.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT bristle_development)
