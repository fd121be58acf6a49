// The shortest path that divides a disk so that both parts have the corners that the cones in them
// ask for (thesis 5.2.1, equation 5.1): Dijkstra's algorithm, led by the distance that is left, on
// the branched cover of the disk, whose sheets are the excess that a path has passed (5.4.1, "Extra
// Cut").
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/disk_boundary.h"

namespace flipfree::seamless {

// From one place of the boundary to another one. The part on its left has the corners strictly
// between `to` and `from`, and two more at the path's ends.
struct PathEnds {
  Index from = kInvalid;
  Index to = kInvalid;
};
struct SeparatingPath {
  PathEnds ends;
  Index corners = 0;  // of the part on its left
  std::vector<HalfedgeId> halfedges;
};

// Corners of the left part.
inline Index left_corners(const DiskBoundary& boundary, const PathEnds& ends) {
  return boundary.corners_between(ends.to, ends.from) + 2;
}

// From one place to another one, with cones of this excess on its left in all; nothing if the
// search ends without one, likewise.
std::optional<SeparatingPath> shortest_enclosing_path(const Canvas& canvas,
                                                      const DiskBoundary& boundary,
                                                      const PathEnds& ends, Index excess,
                                                      const ExecutionContext& context);

// From one of the places `from` to one of the places `to` for which `allowed(ends)` is true, such
// that the left part has 4 + sum of (k - 4) corners over its cones, not a multiple of four. Nothing
// if the search ends without one, which does not prove that there is none: of paths on the same
// sheet that meet in a vertex only the shorter one goes on, if it does not meet itself, and at most
// a fixed multiple of #V are looked at. Cost: O(n log n) for n of them.
std::optional<SeparatingPath> shortest_separating_path(
    const Canvas& canvas, const DiskBoundary& boundary, const std::vector<Index>& from,
    const std::vector<Index>& to, const std::function<bool(const PathEnds&)>& allowed,
    const ExecutionContext& context);

}  // namespace flipfree::seamless
