# Cross-compiles for 64-bit Windows on Debian (clang-19, lld-19, mingw-w64's headers and runtime) and runs the result by
# wine, for tools/upkeep/check_windows. Does not use mingw's g++, which keeps the stack at 16 bytes and moves 32- and 64-byte
# vectors to it as if they were aligned (GCC bug 54412): a kernel then ends in a fault. Debian's g++ is patched to write
# unaligned moves; others (MSYS2) are not.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
foreach(language C CXX)
  set(CMAKE_${language}_COMPILER_TARGET x86_64-w64-mingw32)
  # Makes clang keep thread-local variables in an emulated table, as mingw's libstdc++ does.
  set(CMAKE_${language}_FLAGS_INIT -femulated-tls)
endforeach()
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
foreach(kind EXE SHARED MODULE)
  set(CMAKE_${kind}_LINKER_FLAGS_INIT "-fuse-ld=lld-19 -static")
endforeach()
set(CMAKE_CXX_STANDARD_LIBRARIES "-lstdc++ -lwinpthread")
set(CMAKE_CROSSCOMPILING_EMULATOR wine)
# Searches only a folder of header-only packages, which lacks the building machine's C headers.
set(CMAKE_FIND_ROOT_PATH ${CMAKE_CURRENT_LIST_DIR}/../build/windows-headers)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind PACKAGE INCLUDE LIBRARY)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_FIND_ROOT_PATH}) # no libraries of the building machine
file(GLOB folders ${CMAKE_FIND_ROOT_PATH}/usr/lib/*/cmake/xsimd)
if(folders)
  list(GET folders 0 xsimd_DIR)
endif()
