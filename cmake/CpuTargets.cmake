# The core is compiled once per CPU target, each into a Python module of its own, and
# python/linkwise/_core.py imports the best one that the machine supports. One module per target,
# never one module with several: the linker would merge the copies of an inline function and an old
# CPU would meet instructions that it does not have.

include(CheckCXXSourceCompiles)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$" AND NOT CMAKE_OSX_ARCHITECTURES MATCHES
                                                               "arm64")
  set(linkwise_default_targets v2 v3 v4)
else()
  set(linkwise_default_targets generic)
endif()
set(LINKWISE_CPU_TARGETS "${linkwise_default_targets}"
    CACHE STRING "CPU targets to build: v2, v3, v4 (levels of x86-64), generic, native")

set(linkwise_flags_v2 -march=x86-64-v2)
set(linkwise_lanes_v2 2)
set(linkwise_flags_v3 -march=x86-64-v3)
set(linkwise_lanes_v3 4)
set(linkwise_flags_v4 -march=x86-64-v4 -mprefer-vector-width=512)
set(linkwise_lanes_v4 8)
set(linkwise_flags_generic "")
set(linkwise_lanes_generic 2)
set(linkwise_flags_native -march=native)
set(linkwise_lanes_native 2)

if("native" IN_LIST LINKWISE_CPU_TARGETS)
  set(CMAKE_REQUIRED_FLAGS -march=native)
  check_cxx_source_compiles(
    "#ifndef __AVX2__\n#error no\n#endif\nint main() { return 0; }" LINKWISE_NATIVE_AVX2)
  check_cxx_source_compiles(
    "#ifndef __AVX512DQ__\n#error no\n#endif\nint main() { return 0; }" LINKWISE_NATIVE_AVX512)
  unset(CMAKE_REQUIRED_FLAGS)
  if(LINKWISE_NATIVE_AVX512)
    set(linkwise_lanes_native 8)
    list(APPEND linkwise_flags_native -mprefer-vector-width=512)
  elseif(LINKWISE_NATIVE_AVX2)
    set(linkwise_lanes_native 4)
  endif()
endif()

# Compiles every source of the core for one CPU target into the object library linkwise_core_<target>.
function(linkwise_add_core target)
  if(NOT DEFINED linkwise_lanes_${target})
    message(FATAL_ERROR "LINKWISE_CPU_TARGETS: unknown target '${target}'; "
                        "known are v2, v3, v4, generic, native")
  endif()
  set(core linkwise_core_${target})
  add_library(${core} OBJECT ${LINKWISE_SOURCES})
  target_link_libraries(${core} PUBLIC linkwise_flags)
  target_compile_options(${core} PUBLIC ${linkwise_flags_${target}})
  target_compile_definitions(${core} PUBLIC LINKWISE_LANES=${linkwise_lanes_${target}}
                                            LINKWISE_CPU_TARGET="${target}")
  if(TARGET linkwise_sundials)
    target_link_libraries(${core} PRIVATE $<BUILD_INTERFACE:linkwise_sundials>)
    target_compile_definitions(${core} PUBLIC LINKWISE_WITH_SUNDIALS=1)
  endif()
endfunction()
