// Connected parts so small beside the others that a grid of 32-bit values would hold them as
// points: mapped larger than in scale.
#pragma once

#include <optional>

#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

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

}  // namespace flipfree::seamless
