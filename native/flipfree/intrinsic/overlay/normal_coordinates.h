// Normal coordinates: disjoint curves between the vertices of a triangulation, pulled tight, are
// known up to isotopy by how often they cross each edge (Thurston; Mosher 1988), and a flip changes
// one number by a formula in those of the quadrilateral around it.
//
//            k          Of the curves in the triangle i j k, seen from the corner at i: those that
//          /   \        start in it leave through jk (emanating), those that cut it off cross ij
//          and
//         i --- j       ki (turning). At most one corner of a triangle has emanating curves, two
//          \   /        such curves would cross.
//            l
//
// Who keeps them: overlay_coordinates.h for the input's edges over an intrinsic triangulation, with
// the place of each curve around its vertices; matchmaker's moving pins for arcs in a polygon, with
// their vertices' places in the plane. Both flip a mesh of their own kind; the numbers are these.
#pragma once

#include <algorithm>
#include <cstdint>

namespace flipfree::intrinsic {

// Curves that start at the corner between sides a and b and cross side c, for crossing numbers a,
// b, c.
inline std::int64_t emanating(std::int64_t a, std::int64_t b, std::int64_t c) {
  return std::max<std::int64_t>(0, c - a - b);
}

// Curves that cross both a and b; those that emanate from another corner are not counted twice.
inline std::int64_t turning(std::int64_t a, std::int64_t b, std::int64_t c) {
  if (c >= a + b) return 0;
  if (a >= b + c) return b;
  if (b >= a + c) return a;
  return (a + b - c) / 2;
}

// The curves in a triangle, by where they lead, as seen from one of its edges, UV; P is the third
// corner. Along UV, in order from U: those around U, those that end in P, those around V.
struct Strands {
  std::int64_t at_u, at_v, at_p;  // around the corners
  std::int64_t end_p;             // across UV, ending in P
  std::int64_t end_u, end_v;      // across VP and UP, ending in U and V

  // From the numbers that cross each edge.
  Strands(std::int64_t uv, std::int64_t up, std::int64_t vp)
      : at_u(turning(uv, up, vp)),
        at_v(turning(uv, vp, up)),
        at_p(turning(up, vp, uv)),
        end_p(emanating(up, vp, uv)),
        end_u(emanating(uv, up, vp)),
        end_v(emanating(uv, vp, up)) {}
};

// Crossing numbers of an edge ij and of the sides of its two triangles i j k and j i l.
struct QuadCrossings {
  std::int64_t ij, jk, ki, il, lj;
  bool along;  // does a curve run along ij?
};

// The same of the edge kl that a flip puts in its place.
struct FlippedCrossings {
  std::int64_t count;
  bool along;
};

inline FlippedCrossings after_flip(const QuadCrossings& q) {
  // A curve crosses kl if it separates k or l from the diagonal, or starts at i or j into the
  // opposite side, or passes from the side of i to the side of j, or runs along ij.
  const Strands up(q.ij, q.ki, q.jk), low(q.ij, q.il, q.lj);
  FlippedCrossings kl{};
  kl.count = up.at_p + low.at_p + up.end_u + up.end_v + low.end_u + low.end_v +
             std::max<std::int64_t>(0, up.at_u - low.at_u - low.end_p) +
             std::max<std::int64_t>(0, low.at_u - up.at_u - up.end_p) + (q.along ? 1 : 0);
  // One that ends in k above and in l below.
  kl.along = std::min(up.at_u + up.end_p, low.at_u + low.end_p) > std::max(up.at_u, low.at_u);
  return kl;
}

}  // namespace flipfree::intrinsic
