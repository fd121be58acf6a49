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

// Which flip the edge would get, by its labels and those of its faces. None if its type is never
// non-Delaunay (Proposition 3: an edge with a symmetric face on both sides that does not cross the
// line), if it is a diagonal or in copy 2 (its mirror image is flipped instead), or if both its
// sides are the same face.
std::optional<FlipType> flip_type(const IntrinsicMesh& mesh, EdgeId e);

// The edges around an edge that is about to be flipped symmetrically, and which lengths its flip
// creates. Letters: a, c are the ends of a flipped edge of copy 1, b the apex beside it, primes are
// mirror images; see the drawings in symmetric_flips.cpp. Unused entries are kInvalid.
struct FlipStencil {
  FlipType type = FlipType::kInterior;
  PlainFlips plain;      // what flip_symmetrically will do
  EdgeId e = kInvalid;   // the edge, and
  EdgeId jk = kInvalid;  // kInterior: the four edges around it, as in the drawing above
  EdgeId ki = kInvalid;
  EdgeId im = kInvalid;
  EdgeId mj = kInvalid;
  EdgeId x = kInvalid;          // (a, b)
  EdgeId y = kInvalid;          // (b, c)
  EdgeId w = kInvalid;          // (a, a'), perpendicular
  EdgeId v = kInvalid;          // (c, c'), perpendicular
  EdgeId diagonal = kInvalid;   // of the quadrilateral next to e, on the a side if there are two
  EdgeId diagonal2 = kInvalid;  // kQuadQuad: of the one on the c side
  // Edges whose length the flip sets (ids after the flip).
  EdgeId new_cross = kInvalid;      // kTriangle, kQuad, kParallel: (b, b'), perpendicular
  EdgeId new_side = kInvalid;       // the flipped edge, or (a, c) and
  EdgeId new_side2 = kInvalid;      // its mirror image
  EdgeId new_diagonal = kInvalid;   // of the only new quadrilateral, or of the one with w
  EdgeId new_diagonal2 = kInvalid;  // of the one with v
};
FlipStencil flip_stencil(const IntrinsicMesh& mesh, EdgeId e, FlipType type);

// Flips symmetrically: connectivity, labels, reflection; lengths are the caller's business
// (flip_lengths.h).
void flip_symmetrically(IntrinsicMesh& mesh, const FlipStencil& stencil);

}  // namespace flipfree::intrinsic
