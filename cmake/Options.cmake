# One place for the flags that every target of ours gets.
# Several sources in one compilation read the headers of CGAL and gRPC once. Good for builds from nothing; whoever edits
# a source compiles its neighbours, too (docs/testing.md).
option(NDMAP_UNITY "Compile several sources at a time" OFF)
if(NDMAP_UNITY)
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 8)
endif()
# What one clone compiled, another one finds, too, whatever their folders. The compiler's list of headers spares ccache
# preprocessing each source itself, but not with unity builds: their sources name the folder, which only what the
# preprocessor makes of them can be compared without.
find_program(NDMAP_CCACHE ccache)
if(NDMAP_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(launcher ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1)
  if(NOT NDMAP_UNITY)
    list(APPEND launcher CCACHE_DEPEND=1)
  endif()
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher} ${NDMAP_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher} ${NDMAP_CCACHE})
endif()
find_program(NDMAP_MOLD mold)
if(NDMAP_MOLD)
  add_link_options(-fuse-ld=mold)
endif()

add_library(ndmap_options INTERFACE)
target_include_directories(ndmap_options INTERFACE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
# Points must have the same bits in every block whatever the machine: no contraction to fused
# multiply-add (GCC's default), and CGAL's interval arithmetic needs the rounding mode respected.
target_compile_options(ndmap_options INTERFACE
  -Wall -Wextra -Werror -Wno-unused-parameter -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(ndmap_options INTERFACE -frounding-math)
endif()
# Reports need lines, not types of variables, and -g1 compiles a quarter faster.
if(NDMAP_SANITIZE)
  target_compile_options(ndmap_options INTERFACE -fsanitize=${NDMAP_SANITIZE} -fno-omit-frame-pointer -O1 -g1)
  target_link_options(ndmap_options INTERFACE -fsanitize=${NDMAP_SANITIZE})
  if(NDMAP_SANITIZE MATCHES "undefined")
    target_compile_options(ndmap_options INTERFACE -fno-sanitize-recover=undefined)
  endif()
endif()
# The distribution's Abseil and gRPC are not instrumented: with the thread sanitizer only core, the simulator
# and the actors over a fake transport are built.
set(NDMAP_HAS_GRPC ON)
if(NDMAP_SANITIZE MATCHES "thread")
  set(NDMAP_HAS_GRPC OFF)
  target_compile_definitions(ndmap_options INTERFACE NDMAP_THREAD_SANITIZER=1)
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
# Real meshes to test with, where there are any.
set(NDMAP_MESHES "${PROJECT_SOURCE_DIR}/../shared/meshes" CACHE PATH "Folder of test meshes (optional)")
