# Rooms and arrows.
#
# probebox_room(protocol/frame ARROWS protocol/units ... LIBRARIES PkgConfig::X [EXCEPT main.cpp ...] [SOURCES generated.cpp ...])
# declares one room of the house: every header and source that lies in its folder, but those that EXCEPT names, and SOURCES from
# elsewhere. Its headers are included by their path from the top (`#include "protocol/frame/reader.hpp"`), and that path exists
# only inside the room's own include root: a directory of the build tree which holds a link to each of its headers. A room
# therefore sees itself, the rooms its ARROWS name (and what those rooms show in their own headers), and nothing else: a
# forbidden include does not compile. `LIBRARIES` are public when a header shows them, so keep them out of headers and use
# PRIVATE_LIBRARIES where possible.
#
# The presets compile the sources of a room several at once (CMAKE_UNITY_BUILD), which reads what they all include only once;
# names are then unique in a room, also those in unnamed namespaces. tools/setup/alone finds what a source then forgot to include.
# PROBEBOX_NUMBERS_FROM, a build folder, has the rooms of firmware/metrology built already: the sanitizers look at what handles
# bytes and threads, and half of their build would be numbers.
# PROBEBOX_ALONE, a list of rooms, compiles theirs one by one: quicker where one source at a time changes (tools/mutate).
set_property(GLOBAL PROPERTY PROBEBOX_ROOMS "")

# What most sources include of the standard library and Eigen is compiled once for all rooms. Headers of the house are not in it:
# they would be seen from everywhere.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled.cpp CONTENT "")
add_library(probebox_precompiled STATIC ${CMAKE_BINARY_DIR}/precompiled.cpp)
target_link_libraries(probebox_precompiled PRIVATE probebox_compile_options Eigen3::Eigen)
target_precompile_headers(probebox_precompiled PRIVATE
  <Eigen/Geometry> <algorithm> <array> <charconv> <chrono> <cmath> <functional> <map> <memory> <numeric> <optional> <random>
  <span> <sstream> <string> <string_view> <utility> <variant> <vector>)

function(probebox_room room)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "EXCEPT;SOURCES;ARROWS;LIBRARIES;PRIVATE_LIBRARIES")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "probebox_room(${room}): what is '${arg_UNPARSED_ARGUMENTS}'?")
  endif()
  file(GLOB arg_HEADERS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS *.hpp)
  file(GLOB sources RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS *.cpp)
  if(arg_EXCEPT)
    list(REMOVE_ITEM arg_HEADERS ${arg_EXCEPT})
    list(REMOVE_ITEM sources ${arg_EXCEPT})
  endif()
  list(APPEND arg_SOURCES ${sources})
  string(REPLACE "/" "_" name ${room})
  set(root ${CMAKE_BINARY_DIR}/include-roots/${name})
  file(REMOVE_RECURSE ${root})
  file(MAKE_DIRECTORY ${root}/${room})
  foreach(header IN LISTS arg_HEADERS)
    file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${room}/${header} ${root}/${room}/${header} SYMBOLIC)
  endforeach()

  list(TRANSFORM arg_HEADERS PREPEND ${root}/${room}/ OUTPUT_VARIABLE headers)
  list(TRANSFORM arg_ARROWS REPLACE "/" "_" OUTPUT_VARIABLE arrows)
  list(TRANSFORM arrows PREPEND probebox_)
  if(arg_SOURCES AND PROBEBOX_NUMBERS_FROM AND room MATCHES "^firmware/metrology(/|$)")
    add_library(probebox_${name} STATIC IMPORTED GLOBAL)
    set_target_properties(probebox_${name} PROPERTIES
      IMPORTED_LOCATION ${PROBEBOX_NUMBERS_FROM}/${room}/libprobebox_${name}.a SYSTEM OFF)
    target_link_libraries(probebox_${name} INTERFACE ${arrows} ${arg_LIBRARIES} ${arg_PRIVATE_LIBRARIES})
    set(scope INTERFACE)
  elseif(arg_SOURCES)
    add_library(probebox_${name} STATIC ${arg_SOURCES})
    target_link_libraries(probebox_${name} PUBLIC ${arrows} ${arg_LIBRARIES}
                          PRIVATE probebox_compile_options ${arg_PRIVATE_LIBRARIES})
    target_precompile_headers(probebox_${name} REUSE_FROM probebox_precompiled)
    set(scope PUBLIC)
    if(room IN_LIST PROBEBOX_ALONE)
      set_target_properties(probebox_${name} PROPERTIES UNITY_BUILD OFF)
    endif()
  else()
    add_library(probebox_${name} INTERFACE)
    target_link_libraries(probebox_${name} INTERFACE ${arrows} ${arg_LIBRARIES})
    set(scope INTERFACE)
  endif()
  # Each header also compiles on its own. One that has a source is that source's first include (probebox_includes_in_order);
  # the others are compiled alone, seen through the room's root (target all_verify_interface_header_sets).
  set(header_only ${headers})
  foreach(source IN LISTS arg_SOURCES)
    string(REGEX REPLACE "\\.cpp$" ".hpp" header ${root}/${room}/${source})
    list(REMOVE_ITEM header_only ${header})
  endforeach()
  list(REMOVE_ITEM headers ${header_only})
  target_sources(probebox_${name} ${scope}
    FILE_SET HEADERS BASE_DIRS ${root} FILES ${headers}
    FILE_SET header_only TYPE HEADERS BASE_DIRS ${root} FILES ${header_only})
  set_target_properties(probebox_${name} PROPERTIES
    VERIFY_INTERFACE_HEADER_SETS ON INTERFACE_HEADER_SETS_TO_VERIFY header_only)

  set_property(GLOBAL APPEND PROPERTY PROBEBOX_ROOMS ${room})
  set_property(GLOBAL PROPERTY PROBEBOX_ARROWS_${name} "${arg_ARROWS}")
endfunction()

# A way around the roots would be an include that climbs out of its folder, and a header that leans on what stands before it
# would compile by chance; both stop the build.
add_custom_target(probebox_includes_in_order ALL
  COMMAND ${CMAKE_COMMAND} -DROOT=${CMAKE_SOURCE_DIR} -P ${CMAKE_SOURCE_DIR}/cmake/includes-in-order.cmake
  COMMENT "Looking for includes that climb out of their room, or stand before a source's own header" VERBATIM)
