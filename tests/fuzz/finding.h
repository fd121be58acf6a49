// What a target says when a promise is broken.
#pragma once

#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::fuzz {

// Not an exception of the library's kind, so that no handler of a target takes it for one.
struct Finding {
  std::string what;
};

inline void require(bool holds, const char* what) {
  if (!holds) throw Finding{what};
}

// Is this an error that the library may throw? It has a sentence, is no bug caught by an invariant,
// and names elements of the caller's mesh, if there is one: what it calls an edge is one, but where
// the error says that it is none or that an id does not exist. Throws a Finding otherwise.
void check_error(const Exception& e, const mesh::Surface* surface);

// Runs `call`. True if nothing was thrown, false if what was is allowed; exceptions that are not
// the library's are not caught.
template <typename Call>
bool allowed(Call&& call, const mesh::Surface* surface = nullptr) {
  try {
    std::forward<Call>(call)();
    return true;
  } catch (const Exception& e) {
    check_error(e, surface);
    return false;
  }
}

}  // namespace flipfree::fuzz
