# One folder is one library; its headers are included by their path from the root.

add_library(surflect_settings INTERFACE)
target_compile_features(surflect_settings INTERFACE cxx_std_20)
# No contraction: the same source line gives the same bits in every build.
target_compile_options(surflect_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # g++ 12 warns of copies inside std::string that cannot happen, when its header is precompiled.
  target_compile_options(surflect_settings INTERFACE -Wno-array-bounds -Wno-stringop-overread -Wno-stringop-overflow)
endif()
target_include_directories(surflect_settings INTERFACE "${PROJECT_SOURCE_DIR}" "${PROJECT_BINARY_DIR}/generated")

option(SURFLECT_SANITIZE "Build with address and undefined-behaviour sanitizers" OFF)
if(SURFLECT_SANITIZE)
  target_compile_options(surflect_settings INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all)
  target_link_options(surflect_settings INTERFACE -fsanitize=address,undefined)
endif()

option(SURFLECT_FUZZ "Build the fuzz targets, with clang" OFF)
if(SURFLECT_FUZZ)
  target_compile_options(surflect_settings INTERFACE -fsanitize=fuzzer-no-link)
endif()

# Headers that almost every source includes, compiled once. tests/structure/self_contained.py sees to it that headers
# include them all the same.
file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/common_headers.cpp" CONTENT "")
add_library(surflect_common_headers OBJECT "${PROJECT_BINARY_DIR}/generated/common_headers.cpp")
target_link_libraries(surflect_common_headers PRIVATE surflect_settings Eigen3::Eigen)
target_precompile_headers(surflect_common_headers PRIVATE
  <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional>
  <span> <string> <string_view> <variant> <vector>)

set(SURFLECT_BATCH 1 CACHE STRING "Sources of a target compiled together: more build faster, fewer rebuild faster")
# In a batch, local names may be those of functions of other files, g++ 12 takes empty vectors for uninitialised, and
# types of unnamed namespaces for those of headers. Linked last, to come after the other options.
add_library(surflect_batches INTERFACE)
target_compile_options(surflect_batches INTERFACE -Wno-shadow)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  target_compile_options(surflect_batches INTERFACE -Wno-maybe-uninitialized -Wno-subobject-linkage)
endif()

# surflect_batches(TARGET [TIMES]): compiles its sources in batches, TIMES as large as others. Their local names must
# differ within a namespace.
function(surflect_batches target)
  if(SURFLECT_BATCH GREATER 1)
    set(batch ${SURFLECT_BATCH})
    if(ARGC GREATER 1)
      math(EXPR batch "${batch} * ${ARGV1}")
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:surflect_batches>)
  endif()
endfunction()

# surflect_library(NAME [INTERNAL] [SOURCES a.cpp ...] [DEPENDS PUBLIC x PRIVATE y ...])
# The library of the current folder's sources, or of those named. Unless INTERNAL, it is installed with its headers as
# Surflect::NAME. Every header must compile alone: tests/structure/lone_headers.py compiles each, as ./check asks, and
# tests/structure/self_contained.py sees to it that each includes what has been precompiled.
function(surflect_library name)
  cmake_parse_arguments(LIB "INTERNAL" "" "SOURCES;DEPENDS" ${ARGN})
  file(GLOB sources RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  file(GLOB headers RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.h")
  if(LIB_SOURCES)
    set(sources ${LIB_SOURCES})
  endif()
  add_library(${name} STATIC ${sources})
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_precompile_headers(${name} REUSE_FROM surflect_common_headers)
  target_sources(${name} PUBLIC FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${headers})
  string(REPLACE "surflect_" "" exported ${name})
  set_target_properties(${name} PROPERTIES EXPORT_NAME ${exported})
  target_link_libraries(${name} PUBLIC $<BUILD_INTERFACE:surflect_settings> ${LIB_DEPENDS})
  surflect_batches(${name})
  if(NOT LIB_INTERNAL)
    install(TARGETS ${name} EXPORT SurflectTargets FILE_SET HEADERS)
  endif()
endfunction()

# surflect_kernels(TARGET FILE...)
# Sources of the target that are written over Highway: it compiles each for what every processor has, for AVX2 and
# for AVX-512, and chooses when they are called. Fuzz targets, which need none of them, have the first alone.
function(surflect_kernels target)
  target_link_libraries(${target} PRIVATE hwy::hwy)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON
    COMPILE_DEFINITIONS "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4|HWY_AVX3_DL);$<$<BOOL:${SURFLECT_FUZZ}>:HWY_COMPILE_ONLY_STATIC>")
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    # g++ 12 takes the undefined registers in its own intrinsics for a mistake.
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS "-Wno-uninitialized;-Wno-maybe-uninitialized")
  endif()
endfunction()

# surflect_shaders(TARGET FILE...)
# Shaders of one folder, compiled into the target: its sources include "FOLDER/shaders.h", which defines kShaders, an
# array of gl::ShaderFile, in the namespace of the folder's name.
function(surflect_shaders target)
  target_sources(${target} PRIVATE ${ARGN})
  foreach(file ${ARGN})
    cmake_path(ABSOLUTE_PATH file NORMALIZE)
    file(READ "${file}" text)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
    file(RELATIVE_PATH path "${PROJECT_SOURCE_DIR}" "${file}")
    string(APPEND entries "    {\"${path}\", R\"glsl(${text})glsl\"},\n")
  endforeach()
  cmake_path(GET path PARENT_PATH folder)
  cmake_path(GET folder FILENAME namespace)
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/${folder}/shaders.h" CONTENT
"// Shaders of ${folder}.
#pragma once

#include \"render/gl/program.h\"

namespace surflect::${namespace} {

inline constexpr gl::ShaderFile kShaders[] = {
@entries@};

} // namespace surflect::${namespace}
" @ONLY)
endfunction()

# surflect_page(FOLDER NAMESPACE): writes FOLDER/page.h, which holds the files of the folder page/ as text.
function(surflect_page folder namespace)
  file(GLOB page CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/page/*")
  set(entries "")
  foreach(file ${page})
    file(READ "${file}" text)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
    cmake_path(GET file FILENAME name)
    string(APPEND entries "    {\"${name}\", R\"page(${text})page\"},\n")
  endforeach()
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/${folder}/page.h" CONTENT
"// Files of a page that browsers show.
#pragma once

#include <string_view>

namespace @namespace@ {

struct PageFile {
  std::string_view name, text;
};

inline constexpr PageFile kPage[] = {
@entries@};

} // namespace @namespace@
" @ONLY)
endfunction()
