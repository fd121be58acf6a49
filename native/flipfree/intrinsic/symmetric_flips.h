// Flips that keep an intrinsic triangulation symmetric (thesis 4.4.3): an edge of copy 1 together
// with its mirror image, or edges on and across the symmetry line together with the symmetric faces
// beside them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "flipfree/base/types.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"

namespace flipfree::intrinsic {

// The seven symmetric flips of 4.4.3 (the first is also the only flip of a closed surface); faces
// on the left and right of the arrow are those next to the flipped edge.
enum class FlipType : std::uint8_t {
  kInterior,       // (1,1,1) [+ (2,2,2)]: edge and, with a reflection, its mirror image
  kParallel,       // (1,par,2) -> (t,perp,t)
  kPerpendicular,  // (t,perp,t) -> (1,par,2)
  kTriangle,       // (1,1,t) + (2,2,t) -> (t,perp,q)
  kTriangleQuad,   // (t,perp,q) -> (1,1,t) + (2,2,t)
  kQuad,           // (1,1,q) + (2,2,q) -> (q,perp,q)
  kQuadQuad,       // (q,perp,q) -> (1,1,q) + (2,2,q)
};
inline constexpr int kFlipTypes = 7;

// The plain flips that a symmetric flip consists of, in order: apply flip_edge to edges[0 ..
// count).
struct PlainFlips {
  int count = 0;
  std::array<EdgeId, 3> edges{kInvalid, kInvalid, kInvalid};
  const EdgeId* begin() const { return edges.data(); }
  const EdgeId* end() const { return edges.data() + count; }
};

// A symmetric flip of the edge plain.edges[0].
struct FlipRecord {
  FlipType type = FlipType::kInterior;
  bool turned = false;  // what the labels before it decide of those after it (symmetric_flips.cpp)
  PlainFlips plain;
};

// Which flip the edge would get, by its labels and those of its faces. None if its type is never
// non-Delaunay (Proposition 3: an edge with a symmetric face on both sides that does not cross the
// line), if it is a diagonal or in copy 2 (its mirror image is flipped instead), or if both its
// sides are the same face.
std::optional<FlipType> flip_type(const IntrinsicMesh& mesh, EdgeId e);

// The flip of this type of edge e, which is not done yet.
FlipRecord flip_of(const IntrinsicMesh& mesh, EdgeId e, FlipType type);

// Labels and reflection after flip_edge() of all plain flips of `flip`, whose lengths are the
// caller's business (flip_lengths.h).
void relabel(IntrinsicMesh& mesh, const FlipRecord& flip);

}  // namespace flipfree::intrinsic
