"""Builds the module by CMake: pip install ./tools/products/python, pip wheel ./tools/products/python, from a checkout or a source
distribution.

The wheel contains every library that the module needs beside Python, numpy and the C and C++ runtime: it runs without
the checkout, its build folder and the packages that it was built with. JOBS is the number of compilers at a time.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
# Folder with the library's sources in a source distribution; a checkout has none.
CARRIED = HERE / "sources"
ROOT = CARRIED if CARRIED.exists() else HERE.parents[2]
SOURCES = ("CMakeLists.txt", "LICENSE", "bench", "core", "kernels", "tools")
# Folders that a source distribution leaves out: the module does not need them, or git does not keep them.
LEFT_OUT = re.compile(r"__pycache__|build|virtual_room|pictures|guides|conan|vcpkg|.*\.egg-info|bristle-[0-9.]+")
# Shared libraries that every machine with this Python has, so that the wheel need not contain them.
RUNTIME = re.compile(r"^(ld-linux.*|linux-vdso|lib(c|m|dl|rt|pthread|stdc\+\+|gcc_s))\.so")


def version():
    if not (ROOT / "CMakeLists.txt").exists():
        sys.exit("bristle: its Python module is built from a checkout: pip install ./tools/products/python, pip wheel ./tools/products/python")
    header = (ROOT / "core/include/bristle/version.hpp").read_text()
    return ".".join(re.findall(r"#define BRISTLE_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header))


def pybind11():
    """Returns pybind11's version and its CMake option: a package of this Python, else one of the system."""
    try:
        import pybind11 as package
    except ImportError:
        text = pathlib.Path("/usr/include/pybind11/detail/common.h")
        numbers = re.findall(r"#define PYBIND11_VERSION_(?:MAJOR|MINOR) (\d+)", text.read_text()) if text.exists() else ()
        return tuple(map(int, numbers)), []
    return package.version_info[:2], [f"-Dpybind11_DIR={package.get_cmake_dir()}"]


def libraries_of(module):
    """Lists the shared libraries that the module loads and another machine may lack."""
    lines = subprocess.run(["ldd", str(module)], check=True, capture_output=True, text=True).stdout.splitlines()
    for line in lines:
        name, _, path = line.strip().partition(" => ")
        if not path or RUNTIME.match(name):
            continue
        if path.startswith("not found"):
            sys.exit(f"bristle: {module.name} needs {name}, which is not there")
        yield name, pathlib.Path(path.split(" (")[0])


def licence_of(library):
    """Returns the licence of a library; Debian keeps it with the package's documents."""
    if shutil.which("dpkg-query") is None:
        return None
    for path in (library, library.resolve(), pathlib.Path("/usr") / library.resolve().relative_to("/")):
        found = subprocess.run(["dpkg-query", "-S", str(path)], capture_output=True, text=True)
        if found.returncode == 0:
            text = pathlib.Path("/usr/share/doc", found.stdout.split(":")[0], "copyright")
            return text if text.exists() else None
    return None


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        target = pathlib.Path(self.get_ext_fullpath(extension.name)).resolve()
        # Builds in a folder as deep as those of the presets, so that a compiler cache (ccache) filled there serves
        # here.
        build = ROOT / "build" / pathlib.Path(self.build_temp).name.replace("temp.", "python-")
        options = ["-DCMAKE_BUILD_TYPE=Release", "-DBRISTLE_SHARED=OFF", "-DBRISTLE_BUILD_PYTHON=ON", "-DBRISTLE_BUILD_TESTS=OFF",
                   "-DBRISTLE_BUILD_BENCH=OFF", "-DBRISTLE_BUILD_ROOM=OFF", "-DBRISTLE_INSTALL=OFF",
                   f"-DPython_EXECUTABLE={sys.executable}",
                   "-DCMAKE_BUILD_WITH_INSTALL_RPATH=ON", "-DCMAKE_INSTALL_RPATH=$ORIGIN/libraries",
                   # Uses RPATH instead of RUNPATH, since it is also searched for libraries that our libraries load.
                   "-DCMAKE_MODULE_LINKER_FLAGS=-Wl,--disable-new-dtags", *pybind11()[1]]
        if shutil.which("ninja"):
            options.append("-GNinja")
        options += os.environ.get("CMAKE_ARGS", "").split()
        cmake = shutil.which("cmake") or sys.exit("bristle: cmake is needed, 3.25 or newer (apt install cmake)")
        subprocess.run([cmake, "-S", str(ROOT), "-B", str(build), *options], check=True)
        if not (build / "python").exists():
            sys.exit("bristle: CMake left the Python module out; the line above that says so names what to install")
        jobs = os.environ.get("JOBS", str(len(os.sched_getaffinity(0))))
        subprocess.run([cmake, "--build", str(build), "--target", "bristle_python", "--parallel", jobs], check=True)
        built = next((build / "python/bristle").glob("_bristle.*.so"))
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(built, target)
        shutil.copy2(built.with_name("__init__.pyi"), target.parent)
        if shutil.which("strip"):
            subprocess.run(["strip", "--strip-unneeded", str(target)], check=True)
        for name, library in libraries_of(built):
            folder = target.parent / "libraries"
            folder.mkdir(exist_ok=True)
            shutil.copyfile(library, folder / name)
            licence = licence_of(library)
            if licence is not None:
                shutil.copyfile(licence, folder / f"{name}.copyright")


def carried_files():
    """Yields the files to carry, relative to ROOT."""
    for name in SOURCES:
        if (ROOT / name).is_file():
            yield pathlib.Path(name)
        for folder, inner, files in os.walk(ROOT / name):
            inner[:] = sorted(child for child in inner if not LEFT_OUT.fullmatch(child))
            yield from (pathlib.Path(folder, file).relative_to(ROOT) for file in sorted(files))


class SourceDistribution(sdist):
    def make_release_tree(self, base_dir, files):
        carried = list(carried_files())  # lists the files before base_dir exists, which may lie among them
        super().make_release_tree(base_dir, [file for file in files if not file.startswith("..")])
        for file in carried:
            target = pathlib.Path(base_dir, CARRIED.name, file)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / file, target)


# Builds in a scratch folder, so that the source folder stays clean.
SCRATCH = ROOT / "build/python-package"
SCRATCH.mkdir(parents=True, exist_ok=True)

# Limits numpy to versions before 2, whose arrays pybind11 before 2.12 does not know.
NUMPY = "numpy>=1.20" if pybind11()[0] >= (2, 12) else "numpy>=1.20,<2"

setup(
    name="bristle",
    version=version(),
    description="Brush-model friction: patches of elastic bristles that stick, bend and snap, stepped by SIMD kernels",
    long_description=(HERE / "README.md").read_text(),
    long_description_content_type="text/markdown",
    author="The bristle authors",
    license="MIT",
    license_files=[os.path.relpath(ROOT / "LICENSE", HERE)],
    classifiers=["Programming Language :: Python :: 3", "Programming Language :: C++", "Operating System :: POSIX :: Linux",
                 "Topic :: Scientific/Engineering :: Physics", "Typing :: Typed"],
    python_requires=">=3.9",
    install_requires=[NUMPY],
    packages=["bristle"],
    package_dir={"bristle": "package"},
    package_data={"bristle": ["py.typed"]},
    ext_modules=[Extension("bristle._bristle", [])],
    cmdclass={"build_ext": CMakeBuild, "sdist": SourceDistribution},
    zip_safe=False,
    options={"build": {"build_base": os.path.relpath(SCRATCH)}, "egg_info": {"egg_base": os.path.relpath(SCRATCH)}},
)
