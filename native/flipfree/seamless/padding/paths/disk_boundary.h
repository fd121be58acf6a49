// The boundary of the disk that a canvas is when cut along the curves drawn on it, and the cones
// inside as seen from paths through it (thesis 5.4.1, "Extra Cut").
//
//   <--h_2--.           Places are numbered counter-clockwise, the disk on the left: place i is the
//           |           sector that begins with half-edge h_i, between h_i and the opposite of
//     disk  h_1         h_(i-1).
//           |
//   --h_0-->'
#pragma once

#include <vector>

#include "flipfree/seamless/padding/paths/canvas.h"

namespace flipfree::seamless {

struct DiskBoundary {
  std::vector<HalfedgeId> halfedges;
  std::vector<Index> branch;  // of each half-edge: both sides of a branch have the same number
  std::vector<char> corner;   // per place: is it a sector of a node
  std::vector<Index> corners_below;  // per place, and in all: how many corners are before it
  std::vector<Index> place;          // per half-edge of the canvas: i, or kInvalid

  Index size() const { return static_cast<Index>(halfedges.size()); }
  // Corners strictly between two different places, counter-clockwise.
  Index corners_between(Index from, Index to) const;
  // Places strictly between, in order.
  std::vector<Index> places_between(Index from, Index to) const;
};

// Throws InternalError if the curves do not cut the canvas into one disk. Cost: O(#F).
DiskBoundary disk_boundary(const Canvas& canvas);

// Per half-edge an integer, opposite ones of opposite signs, such that those along a simple closed
// counter-clockwise edge path through no cone, within the disk or on its boundary, sum to the
// excess (k - 4) of the cones that it encloses: ways from face to face lead from every cone to
// the boundary, and a path that crosses one from left to right passes that cone. Cost: O(#F).
std::vector<Index> excess_crossed(const Canvas& canvas, const DiskBoundary& boundary);

}  // namespace flipfree::seamless
