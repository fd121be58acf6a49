#include "flipfree/certify/measures/quarter_turns.h"

namespace flipfree::certify {
namespace {

// The quadrant of the direction from o to p: [0, pi/2) is 0, and so on; a quarter turn takes each
// to the next one exactly.
Index quadrant(const Points2& uv, CornerId o, CornerId p) {
  const bool right = uv(p, 0) > uv(o, 0);
  const bool left = uv(p, 0) < uv(o, 0);
  const bool above = uv(p, 1) > uv(o, 1);
  const bool below = uv(p, 1) < uv(o, 1);
  if (right && !below) return 0;
  if (above && !right) return 1;
  if (left && !above) return 2;
  return 3;
}

}  // namespace

std::vector<Index> quarter_turns_around(const mesh::Adjacency& adjacency,
                                        const Points2& corner_uv) {
  std::vector<Index> turns(adjacency.vertex_halfedge.size(), kInvalid);
  for (std::size_t v = 0; v < turns.size(); ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[v];
    if (start == kInvalid || adjacency.opposite[static_cast<std::size_t>(start)] == kInvalid)
      continue;
    Index total = 0;
    HalfedgeId h = start;
    do {
      // A positive corner turns by less than half a turn: into at most two further quadrants.
      total += (quadrant(corner_uv, h, previous_corner(h)) -
                quadrant(corner_uv, h, next_corner(h)) + 4) %
               4;
      h = mesh::rotate_ccw(adjacency, h);
    } while (h != kInvalid && h != start);
    turns[v] = total;
  }
  return turns;
}

}  // namespace flipfree::certify
