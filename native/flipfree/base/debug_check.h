// Checks of our own promises: invariants at stage boundaries, preconditions where a header states
// them. They run in builds with sanitizers and fuzzing (FLIPFREE_DEBUG_CHECKS, set by CMake for all
// sources alike) and are compiled out elsewhere.
#pragma once

#include <string>

namespace flipfree {

#ifdef FLIPFREE_DEBUG_CHECKS
inline constexpr bool kDebugChecks = true;
#else
inline constexpr bool kDebugChecks = false;
#endif

// Throws InternalError, naming the place, unless `broken` is empty.
void require_invariant(const char* place, const std::string& broken);

// find_broken() says what is broken, nothing if all is well; not called where checks are compiled
// out.
template <typename FindBroken>
void debug_check(const char* place, const FindBroken& find_broken) {
  if constexpr (kDebugChecks) require_invariant(place, find_broken());
}

// The same for a condition: holds() or `promise` is broken.
template <typename Holds>
void debug_require(const char* place, const char* promise, const Holds& holds) {
  if constexpr (kDebugChecks) require_invariant(place, holds() ? "" : promise);
}

}  // namespace flipfree
