// What every function that starts from a finished map asks of it.
#pragma once

#include <string>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// Throws InvalidInput, naming the faces, unless the surface is valid and every triangle of
// `corner_uv` (one row per face corner) is positive by the exact predicate.
void require_valid_map(const mesh::Surface& surface, const Points2& corner_uv,
                       const ExecutionContext& context);

// Throws InvalidInput (kBadShape) unless there is a row for every corner.
void require_corner_uv(const mesh::Surface& surface, const Points2& corner_uv);

// Steps that take a map of the solver's own: what is wrong with such a map is no fault of the
// caller's, and no proof of anything.

// step(), whose InvalidInput and Infeasible become NotConverged (kCertificateFailed), without the
// elements and the text, which count what the caller does not know.
template <typename Step>
auto with_own_map(Step step) -> decltype(step()) {
  const auto refuse = [](const Exception& e) {
    throw_not_converged(ErrorCode::kCertificateFailed,
                        "A map on the way to the result was not usable (" +
                            std::string(describe(e.error().code)) +
                            "). Pins that lie closer together and nearer to the origin, or a mesh "
                            "without needles, leave more room.");
  };
  try {
    return step();
  } catch (const InvalidInput& e) {
    refuse(e);
  } catch (const Infeasible& e) {
    refuse(e);
  }
  throw InternalError("refused, and yet here");
}

}  // namespace flipfree::distortion
