// Connected parts so small beside the others that a grid of 32-bit values would hold them as
// points: mapped larger than in scale.
#pragma once

#include <cstdint>
#include <optional>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Typical edges of a part over the extent of the largest one: no grid of 32-bit values holds
// shorter ones; those up to the second it holds if they have room to move.
inline constexpr double kLostEdge = 0x1p-21, kCrampedEdge = 0x1p-12;

struct EnlargedParts {
  mesh::Surface surface;  // the same triangles
  Index count = 0;        // of the parts that are larger
};

// Parts whose typical edge, the extent over the square root of the number of faces, is shorter than
// `least_edge` times the extent of the largest part, each enlarged by the power of two that mends
// this; nullopt if there is none. Precondition: no vertex belongs to two parts. Cost: O(#F).
std::optional<EnlargedParts> enlarge_parts(const mesh::Surface& surface,
                                           const mesh::Adjacency& adjacency, double least_edge);

// A map of the enlarged surface, as one of `surface`: places of all vertices, by their provenance.
void place_on(const mesh::Surface& surface, certify::Parametrization& map);

// solve(parts), of `surface` itself where parts is null, else of parts->surface, whose map it
// returns as one of `surface`: with lost parts enlarged, and with cramped ones too where the map
// that was found could not be stored, which more room may mend. Stats: "enlarged_islands", where
// some were.
template <typename Solve>
certify::Parametrization solve_in_scale(const mesh::Surface& surface,
                                        const mesh::Adjacency& adjacency, const Solve& solve) {
  const auto solved = [&](const std::optional<EnlargedParts>& parts) {
    certify::Parametrization map = solve(parts ? &*parts : nullptr);
    if (parts) map.stats["enlarged_islands"] = static_cast<std::int64_t>(parts->count);
    return map;
  };
  const std::optional<EnlargedParts> lost = enlarge_parts(surface, adjacency, kLostEdge);
  try {
    return solved(lost);
  } catch (const NotConverged& failure) {
    const ErrorCode code = failure.error().code;
    if (code != ErrorCode::kRoundingFlips && code != ErrorCode::kCertificateFailed) throw;
    const std::optional<EnlargedParts> cramped = enlarge_parts(surface, adjacency, kCrampedEdge);
    if (!cramped || (lost && lost->count == cramped->count)) throw;
    return solved(cramped);
  }
}

}  // namespace flipfree::seamless
