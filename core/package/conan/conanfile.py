"""Conan 2 recipe of the library: conan create core/package/conan

It packages the sources that it stands in. To submit it to a recipe index, replace export_sources by a conandata.yml with the
address and checksum of a release, and source() by conan.tools.files.get.
"""

import re
from pathlib import Path

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, rmdir
from conan.tools.scm import Version

required_conan_version = ">=2.0"


class BristleConan(ConanFile):
    name = "bristle"
    description = "Friction of contact patches by the brush model, against a deadline"
    license = "MIT"
    topics = ("friction", "haptics", "physics", "simd", "real-time")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {
        "shared": [True, False],
        "with_tbb": [True, False],
        "with_double": [True, False],
        "with_simd": [True, False],
        "with_eigen": [True, False],
    }
    default_options = {"shared": False, "with_tbb": True, "with_double": True, "with_simd": True, "with_eigen": True}

    def set_version(self):
        header = Path(self.recipe_folder, "../../include/bristle/version.hpp")
        if header.exists():  # in the sources; an exported recipe knows its version
            numbers = re.findall(r"#define BRISTLE_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header.read_text())
            self.version = self.version or ".".join(numbers)

    def export_sources(self):
        root = Path(self.recipe_folder, "../../..")
        for pattern in ("CMakeLists.txt", "LICENSE", "core/*", "kernels/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        if self.options.with_tbb:
            self.requires("onetbb/[>=2021.8 <2023]")
        if self.options.with_simd:
            self.requires("xsimd/8.1.0", visible=False)  # its headers; other versions may have other bits
        if self.options.with_eigen:
            self.requires("eigen/[>=3.4 <4]", transitive_headers=True)

    def validate(self):
        if self.settings.os != "Linux" or self.settings.arch not in ("x86_64", "armv8"):
            raise ConanInvalidConfiguration("bristle is for Linux on x86-64 and 64-bit ARM")
        smallest = {"gcc": "11", "clang": "14"}.get(str(self.settings.compiler))
        if smallest is None or Version(self.settings.compiler.version) < smallest:
            raise ConanInvalidConfiguration("bristle needs g++ 11 or clang++ 14, or newer")
        if self.settings.compiler.get_safe("cppstd"):
            check_min_cppstd(self, 17)  # its headers; it sets C++20 for its sources itself

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["BRISTLE_SHARED"] = bool(self.options.shared)
        toolchain.cache_variables["BRISTLE_WITH_TBB"] = bool(self.options.with_tbb)
        toolchain.cache_variables["BRISTLE_WITH_DOUBLE"] = bool(self.options.with_double)
        if not self.options.with_simd:
            toolchain.cache_variables["BRISTLE_ISAS"] = ""
        for part in ("TOOLS", "ROOM", "TESTS", "BENCH"):
            toolchain.cache_variables[f"BRISTLE_BUILD_{part}"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, Path(self.package_folder, "licenses"))
        CMake(self).install()
        rmdir(self, Path(self.package_folder, "lib", "cmake"))
        rmdir(self, Path(self.package_folder, "lib", "pkgconfig"))

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "bristle")
        self.cpp_info.set_property("pkg_config_name", "bristle")
        library = self.cpp_info.components["bristle"]
        library.set_property("cmake_target_name", "bristle::bristle")
        library.libs = ["bristle"]
        library.system_libs = ["m"]
        if not self.options.shared:
            library.defines = ["BRISTLE_STATIC"]
        if self.options.with_tbb:
            library.requires.append("onetbb::libtbb")
        if self.options.with_eigen:
            eigen = self.cpp_info.components["eigen"]
            eigen.set_property("cmake_target_name", "bristle::eigen")
            eigen.libdirs = []
            eigen.requires = ["bristle", "eigen::eigen3"]
