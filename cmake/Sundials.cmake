# SUNDIALS, the ODE integrators behind integrate/sundials, as the target linkwise_sundials.
#
# LINKWISE_SUNDIALS_PROVIDER
#   wheel   the static libraries inside the Python wheel sundials4py, fetched by pip and checked
#   system  a SUNDIALS >= 6.2 that find_package(SUNDIALS) finds; set SUNDIALS_DIR to point at it
#   off     no SUNDIALS: only the fixed-step integrators are built
#   auto    wheel where one exists for this machine, else system
#
# pip fetches the wheel from whatever index it is configured for, so mirrors and offline caches work;
# LINKWISE_SUNDIALS_WHEEL names a file that is already there.

set(LINKWISE_SUNDIALS_PROVIDER auto CACHE STRING "Where SUNDIALS comes from: auto, wheel, system, off")
set_property(CACHE LINKWISE_SUNDIALS_PROVIDER PROPERTY STRINGS auto wheel system off)
set(LINKWISE_SUNDIALS_WHEEL "" CACHE FILEPATH "A sundials4py wheel to use instead of fetching one")
set(LINKWISE_DOWNLOAD_DIR ${PROJECT_SOURCE_DIR}/build/downloads
    CACHE PATH "Where fetched third-party files are kept, shared by all build folders")

set(linkwise_sundials_version 7.9.0)
set(linkwise_sundials_wheel_prefix sundials4py-${linkwise_sundials_version}-cp312-abi3)
if(CMAKE_SYSTEM_NAME STREQUAL "Linux" AND CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  set(linkwise_sundials_platform manylinux_2_27_x86_64.manylinux_2_28_x86_64)
  set(linkwise_sundials_sha256 695cb4f356b451c65175ce67dff41240e79bc50d93a996896f5010c51bfa3a0d)
elseif(CMAKE_SYSTEM_NAME STREQUAL "Darwin" AND CMAKE_SYSTEM_PROCESSOR STREQUAL "arm64")
  set(linkwise_sundials_platform macosx_11_0_arm64)
  set(linkwise_sundials_sha256 e691f15425fddc5580481afbf6c3b2a77616903a95b4b93fc8b5a7c1815af2d1)
elseif(CMAKE_SYSTEM_NAME STREQUAL "Darwin" AND CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  set(linkwise_sundials_platform macosx_10_15_x86_64)
  set(linkwise_sundials_sha256 1c4e258b09d549b91be6a3f67c0221a2fa86c68dec1f31c8300d317e2fa2294a)
endif()

# Fetches the wheel into LINKWISE_DOWNLOAD_DIR unless it is there, and checks its SHA-256.
function(linkwise_fetch_sundials_wheel result)
  set(wheel ${LINKWISE_DOWNLOAD_DIR}/${linkwise_sundials_wheel_prefix}-${linkwise_sundials_platform}.whl)
  if(LINKWISE_SUNDIALS_WHEEL)
    set(wheel ${LINKWISE_SUNDIALS_WHEEL})
  elseif(NOT EXISTS ${wheel})
    find_package(Python 3.11 REQUIRED COMPONENTS Interpreter)
    string(REPLACE "." ";--platform;" platforms ${linkwise_sundials_platform})
    message(STATUS "Fetching SUNDIALS ${linkwise_sundials_version} with pip")
    # The wheel's Python extension is for >= 3.12, but only its headers and libraries are used.
    execute_process(
      COMMAND
        ${Python_EXECUTABLE} -m pip --disable-pip-version-check download --quiet --no-deps
        --only-binary=:all: --python-version 3.12 --platform ${platforms}
        --dest ${LINKWISE_DOWNLOAD_DIR} sundials4py==${linkwise_sundials_version}
      RESULT_VARIABLE status
      OUTPUT_VARIABLE output
      ERROR_VARIABLE output)
    if(NOT status EQUAL 0)
      message(
        FATAL_ERROR
          "pip could not fetch SUNDIALS (wheel sundials4py ${linkwise_sundials_version}):\n${output}\n"
          "Remedy: give the file with -DLINKWISE_SUNDIALS_WHEEL=..., or install SUNDIALS and set "
          "-DLINKWISE_SUNDIALS_PROVIDER=system, or build without it with =off.")
    endif()
  endif()
  if(NOT EXISTS ${wheel})
    message(FATAL_ERROR "SUNDIALS: ${wheel} does not exist")
  endif()
  file(SHA256 ${wheel} sha256)
  if(NOT sha256 STREQUAL linkwise_sundials_sha256)
    message(FATAL_ERROR "SUNDIALS: ${wheel} has SHA-256 ${sha256}, expected "
                        "${linkwise_sundials_sha256}; delete the file and configure again")
  endif()
  set(${result} ${wheel} PARENT_SCOPE)
endfunction()

# Unpacks the wheel in the build folder and finds its CMake package.
macro(linkwise_find_sundials_wheel)
  linkwise_fetch_sundials_wheel(linkwise_sundials_wheel)
  set(linkwise_sundials_root ${CMAKE_BINARY_DIR}/sundials-${linkwise_sundials_version})
  if(NOT EXISTS ${linkwise_sundials_root}/include)
    file(ARCHIVE_EXTRACT INPUT ${linkwise_sundials_wheel} DESTINATION ${linkwise_sundials_root})
  endif()
  file(GLOB linkwise_sundials_config ${linkwise_sundials_root}/lib*/cmake/sundials)
  find_package(SUNDIALS REQUIRED CONFIG NO_DEFAULT_PATH PATHS ${linkwise_sundials_config})
endmacro()

function(linkwise_add_sundials provider)
  add_library(linkwise_sundials INTERFACE)
  # CVODES is CVODE with sensitivities; the wheel has it alone, systems often have both.
  foreach(solver IN ITEMS cvode cvodes)
    if(TARGET SUNDIALS::${solver})
      target_link_libraries(linkwise_sundials INTERFACE SUNDIALS::${solver})
      string(TOUPPER ${solver} solver_name)
      target_compile_definitions(linkwise_sundials INTERFACE LINKWISE_SUNDIALS_${solver_name}=1)
      break()
    endif()
  endforeach()
  # Its functions got the names that esdirk.cpp uses in SUNDIALS 7.1.
  if(TARGET SUNDIALS::arkode AND SUNDIALS_VERSION VERSION_GREATER_EQUAL 7.1)
    target_link_libraries(linkwise_sundials INTERFACE SUNDIALS::arkode)
    target_compile_definitions(linkwise_sundials INTERFACE LINKWISE_SUNDIALS_ARKODE=1)
  endif()
  foreach(component IN ITEMS nvecserial sunlinsoldense sunlinsolspgmr sunmatrixdense
                             sunnonlinsolfixedpoint sunnonlinsolnewton)
    target_link_libraries(linkwise_sundials INTERFACE SUNDIALS::${component})
  endforeach()
  if(provider STREQUAL "wheel")
    # The wheel's libraries call back into its Python binding; see binding_hooks.cpp.
    target_compile_definitions(linkwise_sundials INTERFACE LINKWISE_SUNDIALS_BINDING_HOOKS=1)
  endif()
  if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    # Keep its symbols inside our modules: another extension may bring a SUNDIALS of its own.
    target_link_options(linkwise_sundials INTERFACE LINKER:--exclude-libs,ALL)
  endif()
  message(STATUS "SUNDIALS ${SUNDIALS_VERSION} (${provider})")
endfunction()

if(LINKWISE_SUNDIALS_PROVIDER STREQUAL "auto")
  if(linkwise_sundials_sha256)
    set(linkwise_sundials_provider wheel)
  else()
    set(linkwise_sundials_provider system)
  endif()
else()
  set(linkwise_sundials_provider ${LINKWISE_SUNDIALS_PROVIDER})
endif()

if(linkwise_sundials_provider STREQUAL "wheel")
  if(NOT linkwise_sundials_sha256)
    message(FATAL_ERROR "LINKWISE_SUNDIALS_PROVIDER=wheel: there is no wheel for "
                        "${CMAKE_SYSTEM_NAME} on ${CMAKE_SYSTEM_PROCESSOR}; use system or off")
  endif()
  linkwise_find_sundials_wheel()
  linkwise_add_sundials(wheel)
elseif(linkwise_sundials_provider STREQUAL "system")
  find_package(SUNDIALS 6.2 REQUIRED)
  linkwise_add_sundials(system)
elseif(NOT linkwise_sundials_provider STREQUAL "off")
  message(FATAL_ERROR "LINKWISE_SUNDIALS_PROVIDER=${LINKWISE_SUNDIALS_PROVIDER}: "
                      "choose auto, wheel, system or off")
endif()
