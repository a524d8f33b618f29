# Cross-compiles for 64-bit ARM on Debian (g++-aarch64-linux-gnu) and runs the result by qemu-aarch64 (qemu-user), for
# tools/upkeep/check_neon. The only package it searches is xsimd, which is header-only.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L /usr/aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)
# Debian keeps the package file of xsimd in the folder of the building machine's architecture.
file(GLOB xsimd_folders /usr/lib/*/cmake/xsimd)
if(xsimd_folders)
  list(GET xsimd_folders 0 xsimd_DIR)
endif()
