# ndmap_library(name SOURCES a.cc b.cc DEPS x y): a static library of ours.
function(ndmap_library name)
  cmake_parse_arguments(A "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${A_SOURCES})
  target_link_libraries(${name} PUBLIC ndmap_options ${A_DEPS})
endfunction()

# The same for a library that programs outside this tree may use, as ndmap::NAME without "ndmap_": nothing of our own flags
# goes to them.
function(ndmap_installed_library name)
  cmake_parse_arguments(A "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${A_SOURCES})
  string(REGEX REPLACE "^ndmap_" "" short ${name})
  add_library(ndmap::${short} ALIAS ${name})
  set_target_properties(${name} PROPERTIES EXPORT_NAME ${short})
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_link_libraries(${name} PUBLIC ${A_DEPS} PRIVATE $<BUILD_INTERFACE:ndmap_options>)
  install(TARGETS ${name} EXPORT ndmap-targets ARCHIVE COMPONENT sdk)
endfunction()

# ndmap_test(name SOURCES a_test.cc DEPS x y [LABELS l] [TIMEOUT s]): a GoogleTest program, one CTest test a case.
function(ndmap_test name)
  cmake_parse_arguments(A "" "LABELS;TIMEOUT" "SOURCES;DEPS" ${ARGN})
  if(NOT NDMAP_BUILD_TESTS)
    return()
  endif()
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 300)
  endif()
  # Sanitized programs are some ten times slower.
  if(NDMAP_SANITIZE)
    math(EXPR A_TIMEOUT "${A_TIMEOUT} * 6")
  endif()
  add_executable(${name} ${A_SOURCES})
  target_link_libraries(${name} PRIVATE ndmap_options ${A_DEPS} GTest::gmock GTest::gtest_main)
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}")
endfunction()
