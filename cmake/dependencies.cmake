# Everything outside the project that the solver links, gathered in one interface target. Headers are
# SYSTEM so that the warning level applies to our code only.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)

find_path(CGAL_INCLUDE CGAL/Exact_predicates_inexact_constructions_kernel.h REQUIRED)
find_path(BOOST_INCLUDE boost/multiprecision/mpfr.hpp REQUIRED)
find_library(GMP_LIBRARY gmp REQUIRED)
find_library(MPFR_LIBRARY mpfr REQUIRED)
find_path(OPENMESH_INCLUDE OpenMesh/Core/IO/IOManager.hh REQUIRED)
find_library(OPENMESH_LIBRARY OpenMeshCore REQUIRED)
# C's mathematics, of which last bits are otherwise each system's own (scripts/libm.sh).
find_library(FLIPFREE_LIBM flipfree_libm PATHS ${PROJECT_SOURCE_DIR}/build/libm)

add_library(flipfree_dependencies INTERFACE)
target_include_directories(flipfree_dependencies SYSTEM INTERFACE ${CGAL_INCLUDE} ${BOOST_INCLUDE} ${OPENMESH_INCLUDE})
target_link_libraries(flipfree_dependencies INTERFACE
  Eigen3::Eigen Threads::Threads $<$<BOOL:${FLIPFREE_LIBM}>:${FLIPFREE_LIBM}> ${OPENMESH_LIBRARY} ${MPFR_LIBRARY} ${GMP_LIBRARY})
target_compile_definitions(flipfree_dependencies INTERFACE CGAL_HEADER_ONLY=1
  CGAL_DISABLE_ROUNDING_MATH_CHECK=1)
