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

// Those that the corner's sides enter from the first to the second: a positive corner turns by less
// than half a turn, into at most two further quadrants.
Index entered_by(const Points2& uv, CornerId c) {
  return (quadrant(uv, c, previous_corner(c)) - quadrant(uv, c, next_corner(c)) + 4) % 4;
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
      total += entered_by(corner_uv, h);
      h = mesh::rotate_ccw(adjacency, h);
    } while (h != kInvalid && h != start);
    turns[v] = total;
  }
  return turns;
}

Index quarter_turns_along(const mesh::Adjacency& adjacency, const Points2& corner_uv,
                          const std::vector<HalfedgeId>& strip) {
  const auto count = static_cast<HalfedgeId>(adjacency.opposite.size());
  Index total = 0;
  for (std::size_t i = 0; i < strip.size(); ++i) {
    const HalfedgeId leaving = strip[(i + 1) % strip.size()];
    if (strip[i] < 0 || strip[i] >= count || leaving < 0 || leaving >= count) return kNoStrip;
    const HalfedgeId entered = adjacency.opposite[static_cast<std::size_t>(strip[i])];
    if (entered == kInvalid || entered / 3 != leaving / 3 || entered == leaving) return kNoStrip;
    // The corner between both edges: on the left hand it is where the entered one begins.
    const bool right = leaving == next_corner(entered);
    total += right ? -entered_by(corner_uv, leaving) : entered_by(corner_uv, entered);
  }
  return total;
}

}  // namespace flipfree::certify
