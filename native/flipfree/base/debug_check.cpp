#include "flipfree/base/debug_check.h"

#include "flipfree/base/error.h"

namespace flipfree {

void require_invariant(const char* place, const std::string& broken) {
  if (!broken.empty()) throw InternalError(std::string(place) + ": " + broken);
}

}  // namespace flipfree
