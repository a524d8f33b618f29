# Builds the friction of bristles in MuJoCo, and the program that compares it with MuJoCo's own. Debian has MuJoCo 2.2;
# for another: -Dmujoco_DIR=<where MuJoCo was installed>/lib/cmake/mujoco.
find_package(mujoco CONFIG QUIET GLOBAL)
if(NOT TARGET mujoco::mujoco)
  bristle_skip("MuJoCo's example" libmujoco-dev)
  return()
endif()
# Clears an include folder that Debian's MuJoCo package names but does not depend on; /usr/include is known anyway.
get_target_property(folders mujoco::mujoco INTERFACE_INCLUDE_DIRECTORIES)
list(FILTER folders EXCLUDE REGEX "libqhull|^/usr/include/?$")
set_target_properties(mujoco::mujoco PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${folders}")
# Compiles the adapters from a copy, without this tree among the include folders, which proves that they can be copied
# out.
add_library(bristle_mujoco_friction STATIC
  ${CMAKE_CURRENT_BINARY_DIR}/mujoco_adapter/mujoco_friction.cpp
  ${CMAKE_CURRENT_BINARY_DIR}/mujoco_adapter/mujoco_joints.cpp)
foreach(file rolling_bed.hpp mujoco_friction.hpp mujoco_friction.cpp mujoco_joints.hpp mujoco_joints.cpp)
  configure_file(examples/${file} mujoco_adapter/${file} COPYONLY)
endforeach()
bristle_compile_flags(bristle_mujoco_friction)
set_target_properties(bristle_mujoco_friction PROPERTIES INCLUDE_DIRECTORIES "" POSITION_INDEPENDENT_CODE ON)
target_link_libraries(bristle_mujoco_friction PUBLIC bristle bristle::eigen mujoco::mujoco)
if(mujoco_VERSION VERSION_GREATER_EQUAL 3.11)
  add_library(bristle_mujoco_plugin MODULE ${CMAKE_CURRENT_BINARY_DIR}/mujoco_adapter/mujoco_plugin.cpp)
  configure_file(examples/mujoco_plugin.cpp mujoco_adapter/mujoco_plugin.cpp COPYONLY)
  bristle_compile_flags(bristle_mujoco_plugin)
  target_link_libraries(bristle_mujoco_plugin PRIVATE bristle_mujoco_friction)
  enable_language(C)
  add_executable(bristle_mujoco_creep examples/mujoco_creep.c)
  target_link_libraries(bristle_mujoco_creep PRIVATE mujoco::mujoco)
  set_target_properties(bristle_mujoco_plugin bristle_mujoco_creep PROPERTIES
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR} RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
endif()
add_library(bristle_mujoco_parts STATIC examples/mujoco_scenes.cpp)
bristle_compile_flags(bristle_mujoco_parts)
target_link_libraries(bristle_mujoco_parts PUBLIC bristle_mujoco_friction PRIVATE fmt::fmt)

add_executable(bristle_mujoco examples/mujoco_main.cpp)
bristle_compile_flags(bristle_mujoco)
bristle_compile_lightly(bristle_mujoco)
target_link_libraries(bristle_mujoco PRIVATE bristle_mujoco_parts bristle_reports CLI11::CLI11)
set_target_properties(bristle_mujoco PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
