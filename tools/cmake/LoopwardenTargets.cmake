# SPDX-License-Identifier: Apache-2.0
# One CMake target per source folder. A target sees only the headers of its folder and of the
# targets it links: a forbidden #include does not compile.

# Flags of every target of this project. Contraction into fused multiply-add is off so that the same input produces the
# same bits on x86-64 and arm64, where g++ would contract (limits: model/README.md).
add_library(loopwarden_flags INTERFACE)
target_compile_options(loopwarden_flags INTERFACE
  -Wall -Wextra -Wpedantic -Werror -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion
  -Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual -Wformat=2 -Wcast-align
  -ffp-contract=off -fno-omit-frame-pointer
  # tools/rt_gate.py reads the program that ships: every jump through a pointer in it is then a call
  # of an interface.
  -fno-jump-tables)
# A program loads only the shared libraries that it calls.
target_link_options(loopwarden_flags INTERFACE -Wl,--as-needed)
# A program has only the functions that it can reach. Otherwise it has whole objects, and an object of a unity build has 16
# or more sources.
if(NOT LOOPWARDEN_SHORT_BUILD)
  target_compile_options(loopwarden_flags INTERFACE -ffunction-sections -fdata-sections)
  target_link_options(loopwarden_flags INTERFACE -Wl,--gc-sections)
endif()
# g++ 12 warns of overlapping copies inside std::string's operator+ at -O2 and above (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(loopwarden_flags INTERFACE -Wno-restrict)
endif()
# Targets that print the version link this. In a build of single sources, only those are compiled again when it changes.
# A package adds its commit, for example +git20261128.1722.e6a3551. Other builds have none, so a commit recompiles nothing.
set(LOOPWARDEN_VERSION_SUFFIX "" CACHE STRING "follows the version that the programs print")
add_library(loopwarden_version INTERFACE)
target_compile_definitions(loopwarden_version INTERFACE LOOPWARDEN_VERSION="${PROJECT_VERSION}${LOOPWARDEN_VERSION_SUFFIX}")

# Parts that neither step loops nor answer many requests are compiled for size: programs that a user starts, and services
# that wait most of their time. With LOOPWARDEN_SHORT_BUILD these are not optimised, and the others a little; with tests,
# which spend minutes in the estimator, its folders have the flags of the package.
# The build type of a Debian package is None.
function(loopwarden_optimise target)
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  if(folder MATCHES "^(config|workbench|services|lab)")
    if(LOOPWARDEN_SHORT_BUILD)
      target_compile_options(${target} PRIVATE -O0)
    elseif(LOOPWARDEN_SANITIZE)
      target_compile_options(${target} PRIVATE -O1)
    else()
      target_compile_options(${target} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-Os>)
    endif()
  elseif(LOOPWARDEN_SHORT_BUILD AND LOOPWARDEN_TESTS AND folder MATCHES "^model/(estimator|effects|plant)$")
    target_compile_options(${target} PRIVATE -O2)
  elseif(LOOPWARDEN_SHORT_BUILD)
    target_compile_options(${target} PRIVATE -O1)
  endif()
endfunction()

if(LOOPWARDEN_SANITIZE)
  # g++ 12 sees uninitialised variables in std::regex when it instruments (Catch2 uses it).
  target_compile_options(loopwarden_flags INTERFACE
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_compile_options(loopwarden_flags INTERFACE -fsanitize=${LOOPWARDEN_SANITIZE}
    -fno-sanitize-recover=all)
  target_link_options(loopwarden_flags INTERFACE -fsanitize=${LOOPWARDEN_SANITIZE})
endif()
if(LOOPWARDEN_FUZZ)
  target_link_options(loopwarden_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()

# loopwarden_together(NAME)
# Where many sources are compiled as one (CMAKE_UNITY_BUILD), those of all libraries of the current folder and below
# are: headers of templates are the greater part of what each costs. Every library keeps its name and its view of the
# tree; what a library may not include is found by the build of one source at a time (preset debug).
macro(loopwarden_together name)
  if(CMAKE_UNITY_BUILD)
    set(loopwarden_group ${name}_together)
    add_library(${loopwarden_group} STATIC)
    # These sources share their headers, and most of what those instantiate.
    math(EXPR loopwarden_batch "4 * ${CMAKE_UNITY_BUILD_BATCH_SIZE}")
    set_target_properties(${loopwarden_group} PROPERTIES UNITY_BUILD_BATCH_SIZE ${loopwarden_batch})
    target_link_libraries(${loopwarden_group} PRIVATE loopwarden_flags)
    loopwarden_optimise(${loopwarden_group})
    if(LOOPWARDEN_FUZZ)
      target_compile_options(${loopwarden_group} PRIVATE -fsanitize=fuzzer-no-link)
    endif()
  endif()
endmacro()

# loopwarden_check_arrows()
# Fails if a folder depends on a folder above it, or if another program depends on an inner part of the daemon.
set(LOOPWARDEN_LAYERS base model "hal|record|config" daemon "workbench|services" "lab|tests")
function(loopwarden_layer folder result)
  set(layer 0)
  foreach(folders ${LOOPWARDEN_LAYERS})
    if(folder MATCHES "^(${folders})(/|$)")
      set(${result} ${layer} PARENT_SCOPE)
    endif()
    math(EXPR layer "${layer} + 1")
  endforeach()
endfunction()
function(loopwarden_check_arrows)
  get_property(targets GLOBAL PROPERTY LOOPWARDEN_TARGETS)
  foreach(target ${targets})
    get_property(folder GLOBAL PROPERTY LOOPWARDEN_FOLDER_${target})
    get_property(linked GLOBAL PROPERTY LOOPWARDEN_LINKS_${target})
    loopwarden_layer(${folder} own)
    foreach(link ${linked})
      get_property(other GLOBAL PROPERTY LOOPWARDEN_FOLDER_${link})
      if(NOT other)
        continue()
      endif()
      loopwarden_layer(${other} below)
      if(below GREATER own)
        message(FATAL_ERROR "${folder} must not use ${other}: dependencies point downwards (CONTRIBUTING.md)")
      endif()
      if(folder MATCHES "^(workbench|services)/" AND other MATCHES "^daemon/" AND NOT other MATCHES "^daemon/(protocol|protocol/planned_test|registers)$")
        message(FATAL_ERROR "${folder} must not use ${other}: other programs see only daemon/protocol and daemon/registers")
      endif()
    endforeach()
  endforeach()
endfunction()

# loopwarden_library(NAME [SOURCES files...] [LINK targets...])
# Defines NAME for the current folder. Its headers are included as "<folder>/<file>.hpp" from the
# top of the tree, and only by targets that link NAME.
function(loopwarden_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(view ${CMAKE_BINARY_DIR}/include/${name})
  get_filename_component(parent ${view}/${folder} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR} ${view}/${folder} SYMBOLIC)
  set_property(GLOBAL APPEND PROPERTY LOOPWARDEN_TARGETS ${name})
  set_property(GLOBAL PROPERTY LOOPWARDEN_FOLDER_${name} ${folder})
  set_property(GLOBAL PROPERTY LOOPWARDEN_LINKS_${name} ${ARG_LINK})
  if(ARG_SOURCES AND loopwarden_group)
    list(TRANSFORM ARG_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
    target_sources(${loopwarden_group} PRIVATE ${ARG_SOURCES})
    target_include_directories(${loopwarden_group} PUBLIC ${view})
    foreach(linked ${ARG_LINK})
      set(group)
      if(TARGET ${linked})
        get_target_property(group ${linked} LOOPWARDEN_TOGETHER)
      endif()
      if(NOT group STREQUAL ${loopwarden_group})
        target_link_libraries(${loopwarden_group} PUBLIC ${linked})
      endif()
    endforeach()
    add_library(${name} INTERFACE)
    set_target_properties(${name} PROPERTIES LOOPWARDEN_TOGETHER ${loopwarden_group})
    target_link_libraries(${name} INTERFACE ${loopwarden_group})
  elseif(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_include_directories(${name} PUBLIC ${view})
    target_link_libraries(${name} PUBLIC ${ARG_LINK} PRIVATE loopwarden_flags)
    loopwarden_optimise(${name})
    # Fuzzers are led by the coverage of what their input gets to; that of the rest would only take time.
    if(LOOPWARDEN_FUZZ AND NOT folder MATCHES "^model/(analysis|diagnosis|gap|alarm|watch|specialist/.*)$")
      target_compile_options(${name} PRIVATE -fsanitize=fuzzer-no-link)
    endif()
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${view})
    target_link_libraries(${name} INTERFACE ${ARG_LINK})
  endif()
endfunction()

# loopwarden_executable(NAME SOURCES files... [LINK targets...])
function(loopwarden_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} loopwarden_flags)
  loopwarden_optimise(${name})
endfunction()

# loopwarden_embed(TARGET HEADER NAMESPACE [NAME FILE]...)
# Defines the library TARGET that holds each file's text as NAMESPACE::NAME, a `const char*` that HEADER declares.
function(loopwarden_embed target header namespace)
  add_library(${target} STATIC)
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE loopwarden_flags)
  while(ARGN)
    list(POP_FRONT ARGN name file)
    get_filename_component(file ${file} ABSOLUTE)
    set(source ${CMAKE_CURRENT_BINARY_DIR}/embedded/${name}.cpp)
    add_custom_command(OUTPUT ${source}
      COMMAND ${CMAKE_COMMAND} -DIN=${file} -DOUT=${source} -DHEADER=${header} -DNAMESPACE=${namespace} -DNAME=${name}
        -P ${CMAKE_SOURCE_DIR}/tools/cmake/embed.cmake
      DEPENDS ${file} ${CMAKE_SOURCE_DIR}/tools/cmake/embed.cmake
      VERBATIM)
    target_sources(${target} PRIVATE ${source})
  endwhile()
endfunction()
