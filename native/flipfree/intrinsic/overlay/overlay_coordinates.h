// Normal coordinates and roundabouts: how the edges of the input triangulation M0 run over a
// triangulation T that was made from it by edge flips, kept in a few integers per edge of T and
// updated in O(1) per flip.
//
// After Gillespie, Springborn, Crane 2021, "Discrete conformal equivalence of polyhedral surfaces",
// and Gillespie, Sharp, Crane 2021, "Integer coordinates for intrinsic geometry processing". The
// isotopy class is exact: there is no floating-point number here, and it does not matter whether a
// flip was Euclidean or a Ptolemy flip (thesis 4.2.4, 4.5). Where the curves meet geometrically is
// the business of overlay_positions.h.
//
// h runs from i to j with face (h, hn, hp) on its left, o = h ^ 1 from j to i. Letters of
// overlay_coordinates.cpp:
//
//            k
//          / | \             hn = next[h]: j -> k, hp: k -> i,
//        hp  |  hn           on = next[o]: i -> l, op: l -> j.
//        /   |   \.
//       i --h|o-- j          flip(h) turns h into l -> k with face (h, hp, on),
//        \   |   /           and o into k -> l with face (o, op, hn).
//        on  |  op
//          \ | /
//            l
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/intrinsic/flip_mesh.h"

namespace flipfree::intrinsic {

// Numbers of curves of M0 in one triangle of T, seen from the corner at the source of half-edge h.
struct CornerCounts {
  std::int64_t emanating =
      0;                     // curves that start in this corner and leave through the opposite side
  std::int64_t turning = 0;  // curves that cut this corner off: they cross h and previous(h)
};

class OverlayCoordinates {
 public:
  // T = M0 = mesh: every edge is shared.
  explicit OverlayCoordinates(FlipMesh mesh);

  // Flips half-edge h of T. Precondition: the two sides of h are different faces. Throws
  // InternalError if the number of crossings of one edge leaves the range of 62 bits.
  void flip(HalfedgeId h);

  const FlipMesh& input() const { return input_; }      // M0
  const FlipMesh& current() const { return current_; }  // T

  // Is h an edge of M0 as well?
  bool shared(HalfedgeId h) const { return crossings_[static_cast<std::size_t>(h)] < 0; }
  // Number of times that curves of M0 cross h.
  std::int64_t crossings(HalfedgeId h) const {
    const std::int64_t n = crossings_[static_cast<std::size_t>(h)];
    return n < 0 ? 0 : n;
  }
  CornerCounts corner(HalfedgeId h) const;

  // The half-edges of M0 out of vertex v in counter-clockwise order.
  const HalfedgeId* star(VertexId v) const {
    return star_.data() + star_begin_[static_cast<std::size_t>(v)];
  }
  Index degree(VertexId v) const {
    return star_begin_[static_cast<std::size_t>(v) + 1] - star_begin_[static_cast<std::size_t>(v)];
  }
  // Place in star(source(h)) of the first curve at or counter-clockwise after half-edge h of T.
  Index roundabout(HalfedgeId h) const { return roundabout_[static_cast<std::size_t>(h)]; }

 private:
  Index roundabout_after(HalfedgeId h) const;

  FlipMesh input_;
  FlipMesh current_;
  std::vector<std::int64_t> crossings_;  // #H, equal on both half-edges of an edge; -1 = shared
  std::vector<Index> roundabout_;        // #H
  std::vector<Index> star_begin_;        // #V + 1
  std::vector<HalfedgeId> star_;         // #H
};

}  // namespace flipfree::intrinsic
