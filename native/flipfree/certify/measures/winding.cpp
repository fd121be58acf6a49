#include "flipfree/certify/measures/winding.h"

namespace flipfree::certify {
namespace {

// Is the direction p - o in the half-open half-plane of angles [0, pi)? Comparisons of coordinates
// are exact.
bool upper(const Points2& uv, CornerId o, CornerId p) {
  return uv(p, 1) > uv(o, 1) || (uv(p, 1) == uv(o, 1) && uv(p, 0) > uv(o, 0));
}

}  // namespace

std::vector<VertexId> winding_failures(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  std::vector<VertexId> failures;
  const auto vertex_count = static_cast<VertexId>(adjacency.vertex_halfedge.size());
  for (VertexId v = 0; v < vertex_count; ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    if (start == kInvalid || adjacency.opposite[static_cast<std::size_t>(start)] == kInvalid)
      continue;
    // Each positively oriented corner turns counter-clockwise by less than pi, so the number of
    // turns is the number of corners in which the direction enters the upper half-plane.
    Index turns = 0;
    bool uncut = true;
    HalfedgeId h = start;
    do {
      uncut = uncut && !cuts[static_cast<std::size_t>(h)];
      const bool from = upper(corner_uv, h, next_corner(h));
      const bool to = upper(corner_uv, h, previous_corner(h));
      if (!from && to) ++turns;
      h = mesh::rotate_ccw(adjacency, h);
    } while (h != start);  // an inner vertex: its faces close around it
    if (uncut && turns != 1) failures.push_back(v);
  }
  return failures;
}

}  // namespace flipfree::certify
