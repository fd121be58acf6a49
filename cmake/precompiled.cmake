# Headers that nearly every file includes, libraries' and our own, are compiled once: half of a file's time was reading them.
# Every file includes what it uses all the same; the builds for sanitizers, fuzzing and coverage do without, and would say so.
option(FLIPFREE_PRECOMPILED "Compile common headers once" ON)
if(FLIPFREE_SANITIZE OR FLIPFREE_FUZZ OR FLIPFREE_COVERAGE OR NOT CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  set(FLIPFREE_PRECOMPILED OFF)
endif()

set(FLIPFREE_COMMON_HEADERS <algorithm> <array> <chrono> <cmath> <cstdint> <deque> <fstream> <functional> <iomanip> <limits>
  <map> <memory> <mutex> <numeric> <optional> <queue> <random> <semaphore> <set> <span> <sstream> <stop_token> <string> <thread>
  <unordered_map> <unordered_set> <utility> <variant> <vector> <mpfr.h> <Eigen/Core> <Eigen/Geometry> <Eigen/SparseCore>)
foreach(header base/plane base/stats mesh/adjacency mesh/surface certify/certified_map)
  list(APPEND FLIPFREE_COMMON_HEADERS ${PROJECT_SOURCE_DIR}/native/flipfree/${header}.h)
endforeach()

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

# Tests are compiled quickly rather than run quickly: the library that they call is optimised. For the targets of the folder that
# calls it.
macro(compile_quickly)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Its time goes into templates; and at -O1 it finds in Eigen's storage what is not there.
    add_compile_options(-O1 -Wno-maybe-uninitialized)
  else()
    add_compile_options(-O0)
    # What the library and the tests both instantiate the linker takes from the first, which is to be the optimised library.
    add_link_options(SHELL:-Wl,--whole-archive $<TARGET_FILE:flipfree_core> SHELL:-Wl,--no-whole-archive)
  endif()
endmacro()
