# One folder is one library; its headers are included by their path from the root.

add_library(surflect_settings INTERFACE)
target_compile_features(surflect_settings INTERFACE cxx_std_20)
# No contraction: the same source line gives the same bits in every build.
target_compile_options(surflect_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror -ffp-contract=off)
target_include_directories(surflect_settings INTERFACE "${PROJECT_SOURCE_DIR}")

option(SURFLECT_SANITIZE "Build with address and undefined-behaviour sanitizers" OFF)
if(SURFLECT_SANITIZE)
  target_compile_options(surflect_settings INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all)
  target_link_options(surflect_settings INTERFACE -fsanitize=address,undefined)
endif()

option(SURFLECT_FUZZ "Build the fuzz targets, with clang" OFF)
if(SURFLECT_FUZZ)
  target_compile_options(surflect_settings INTERFACE -fsanitize=fuzzer-no-link)
endif()

# surflect_library(NAME [DEPENDS PUBLIC x PRIVATE y ...])
# The library of the current folder's sources. Every header must compile alone: x.h does where x.cpp does, which
# includes it first (a test sees to that, and libraries have no precompiled headers); headers without a source of their
# name are compiled for it.
function(surflect_library name)
  cmake_parse_arguments(LIB "" "" "DEPENDS" ${ARGN})
  file(GLOB sources RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  file(GLOB headers RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.h")
  list(TRANSFORM sources REPLACE "[.]cpp$" ".h" OUTPUT_VARIABLE proven)
  list(REMOVE_ITEM headers ${proven})
  add_library(${name} STATIC ${sources})
  target_sources(${name} PUBLIC FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${headers})
  set_target_properties(${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  target_link_libraries(${name} PUBLIC surflect_settings ${LIB_DEPENDS})
  foreach(simd avx2 avx512)
    set(compiled_for_simd ${sources})
    list(FILTER compiled_for_simd INCLUDE REGEX "_${simd}[.]cpp$")
    if(compiled_for_simd)
      surflect_simd_source(${simd} ${compiled_for_simd})
    endif()
  endforeach()
endfunction()

# surflect_simd_source(avx2|avx512 FILE...)
# Compiles sources of the current folder for one kind of vector instructions (surfel/simd.h). On other processors
# they are empty.
function(surflect_simd_source simd)
  if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    return()
  endif()
  set(options -mavx2 -mfma)
  if(simd STREQUAL avx512)
    # g++ 12 takes the undefined registers in its own intrinsics for a mistake.
    list(APPEND options -mavx512f -mavx512bw -mavx512dq -mavx512vl -Wno-uninitialized)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      list(APPEND options -Wno-maybe-uninitialized)
    endif()
  endif()
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS "${options}")
endfunction()
