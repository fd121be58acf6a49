# Headers of libraries that nearly every file includes are compiled once: half of a file's time was reading them. Every file
# includes what it uses all the same; the builds for sanitizers, fuzzing and coverage do without, and would say so.
option(FLIPFREE_PRECOMPILED "Compile the headers of libraries once" ON)
if(FLIPFREE_SANITIZE OR FLIPFREE_FUZZ OR FLIPFREE_COVERAGE OR NOT CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  set(FLIPFREE_PRECOMPILED OFF)
endif()

set(FLIPFREE_COMMON_HEADERS <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <numeric> <optional>
  <random> <set> <string> <utility> <variant> <vector> <Eigen/Core> <Eigen/Geometry> <Eigen/SparseCore>)

# What ccache needs to know them by their content.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(FLIPFREE_PRECOMPILED_OPTIONS -fpch-preprocess)
else()
  set(FLIPFREE_PRECOMPILED_OPTIONS "SHELL:-Xclang -fno-pch-timestamp")
endif()

# precompile(TARGET [HEADER ...]): those headers, and more.
function(precompile target)
  if(FLIPFREE_PRECOMPILED)
    target_precompile_headers(${target} PRIVATE ${FLIPFREE_COMMON_HEADERS} ${ARGN})
    target_compile_options(${target} PRIVATE ${FLIPFREE_PRECOMPILED_OPTIONS})
  endif()
endfunction()
