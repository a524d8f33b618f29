# A port in the form of microsoft/vcpkg. It packages the sources that it stands in, as an overlay:
#   vcpkg install bristle --classic --overlay-ports=core/package/vcpkg
# Tested with xsimd 8.1 and 13.2 and Eigen 3.4; a manifest selects versions by "overrides" (core/README.md). To submit
# the port, put vcpkg_from_github with REPO, REF and SHA512 of a release in place of the next line.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS features
  FEATURES
    tbb BRISTLE_WITH_TBB
    eigen CMAKE_REQUIRE_FIND_PACKAGE_Eigen3 # a feature that was asked for is not left out without a word
  INVERTED_FEATURES
    eigen CMAKE_DISABLE_FIND_PACKAGE_Eigen3
)
if(NOT "simd" IN_LIST FEATURES)
  list(APPEND features "-DBRISTLE_ISAS=")
endif()
if(VCPKG_LIBRARY_LINKAGE STREQUAL "dynamic")
  list(APPEND features -DBRISTLE_SHARED=ON)
else()
  list(APPEND features -DBRISTLE_SHARED=OFF)
endif()

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    ${features}
    -DBRISTLE_BUILD_TOOLS=OFF
    -DBRISTLE_BUILD_ROOM=OFF
    -DBRISTLE_BUILD_TESTS=OFF
    -DBRISTLE_BUILD_BENCH=OFF
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/bristle)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
