# One place for how everything is compiled. The sanitizer is chosen by a preset.
set(PROBEBOX_SANITIZE "" CACHE STRING "Comma separated -fsanitize list, such as address,undefined or thread")
option(PROBEBOX_FUZZ "Build the libFuzzer targets (needs clang)" OFF)

# Warnings are errors where the compiler is one that the tests run with: g++ of Debian 12 and of Debian 13. Another one may
# warn of more, and still builds.
set(known_compiler OFF)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION MATCHES "^(12|14)\\.")
  set(known_compiler ON)
endif()
option(CMAKE_COMPILE_WARNING_AS_ERROR "A warning stops the build" ${known_compiler})

# -O3 costs a tenth more time to build and pays in a few kernels only, whose rooms ask for it.
string(REPLACE "-O3" "-O2" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
# What ships reads bytes from outside: one written beyond its array ends the process before anybody can use it.
string(APPEND CMAKE_CXX_FLAGS_RELEASE " -fstack-protector-strong -fstack-clash-protection -D_FORTIFY_SOURCE=2")

add_library(probebox_compile_options INTERFACE)
target_compile_options(probebox_compile_options INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  -Woverloaded-virtual -Wcast-align -Wimplicit-fallthrough
  # Same events, same bytes: no fused multiply-add that one machine has and another lacks.
  -ffp-contract=off
  # Of all or of none: what is precompiled serves no source that a library of its own gives this option (GLib of Debian 13).
  -pthread)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Collect garbage later: a twelfth less time to build, a twentieth more memory.
  target_compile_options(probebox_compile_options INTERFACE --param=ggc-min-expand=300)
  # g++ 12 reports false overflows and uninitialised reads inside std::vector, std::variant and Eigen at -O2.
  target_compile_options(probebox_compile_options INTERFACE
    -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds -Wno-maybe-uninitialized -Wno-restrict)
  # It notes on these how g++ before 10.1 passed arguments, which nothing of ours was built with.
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm)")
    target_compile_options(probebox_compile_options INTERFACE -Wno-psabi)
  endif()
endif()

# Every room counts what a fuzzer reaches.
if(PROBEBOX_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=address,undefined)
endif()

# Rooms that compute, and hold no bytes from outside, are not asked whether each double is aligned: a third less time to build
# and to test.
set(probebox_sanitize_numbers "")
if(PROBEBOX_SANITIZE)
  add_compile_options(-fsanitize=${PROBEBOX_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(PROBEBOX_SANITIZE MATCHES "address.*undefined")
    # What these two find, AddressSanitizer finds.
    add_compile_options(-fno-sanitize=null,object-size)
    set(probebox_sanitize_numbers -fno-sanitize=alignment)
  endif()
  add_link_options(-fsanitize=${PROBEBOX_SANITIZE})
endif()
