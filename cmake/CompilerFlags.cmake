# Flags of linkwise's own code, carried by the interface target linkwise_flags.
#
# Fast-math is never switched on as a whole: results must not depend on it, and checks for non-finite numbers must
# survive. The three flags below give its speed where it matters: fused multiply-add, and no errno
# or trap bookkeeping around square roots and selects.

add_library(linkwise_flags INTERFACE)
target_include_directories(linkwise_flags INTERFACE ${PROJECT_SOURCE_DIR}/src)
target_link_libraries(linkwise_flags INTERFACE Threads::Threads)
target_compile_definitions(
  linkwise_flags
  INTERFACE LINKWISE_VERSION="${PROJECT_VERSION}"
            LINKWISE_ASSERTIONS=$<BOOL:${LINKWISE_ASSERTIONS}>
            $<$<BOOL:${LINKWISE_ASSERTIONS}>:_GLIBCXX_ASSERTIONS>)
target_compile_options(
  linkwise_flags
  INTERFACE -Wall -Wextra -Wshadow -Wno-psabi $<$<BOOL:${LINKWISE_WERROR}>:-Werror>
            # GCC 12 warns about its own std::string and std::vector when they are inlined; the
            # address sanitizer watches the same accesses without guessing.
            $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-array-bounds;-Wno-stringop-overflow>
            -ffp-contract=fast -fno-math-errno -fno-trapping-math)

if(LINKWISE_SANITIZE)
  target_compile_options(
    linkwise_flags INTERFACE -O1 -g1 -fno-omit-frame-pointer -fsanitize=${LINKWISE_SANITIZE}
                             -fno-sanitize-recover=all)
  target_link_options(linkwise_flags INTERFACE -fsanitize=${LINKWISE_SANITIZE})
else()
  target_compile_options(linkwise_flags INTERFACE $<$<NOT:$<CONFIG:Debug>>:-O3>)
  # The kernels are small constant-size blocks: they are fast when their loops are unrolled in full
  # and slow when the superword vectoriser then packs the scalars of one block into a register (a
  # factor of two on GCC 12). Vectors come from independent lanes instead, see simd/.
  target_compile_options(linkwise_flags INTERFACE $<$<NOT:$<CONFIG:Debug>>:-fno-tree-slp-vectorize>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(linkwise_flags INTERFACE --param=max-completely-peeled-insns=4000
                                                    --param=max-completely-peel-times=40)
  endif()
endif()
