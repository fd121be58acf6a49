#include "flipfree/seamless/padding/open_cut.h"

#include <cstddef>

#include "flipfree/base/plane.h"

namespace flipfree::seamless {

OpenCut open_cut(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                 const CutSegments& segments, const std::vector<Index>& cones) {
  mesh::EdgeFlags flags(adjacency.opposite.size(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flags[at(h)] = flags[at(adjacency.opposite[at(h)])] = 1;
  }
  OpenCut open{mesh::cut_along(cut.surface.faces, adjacency, flags), {}};
  open.angle.resize(open.mesh.vertex_origin.size());
  for (std::size_t v = 0; v < open.angle.size(); ++v)
    open.angle[v] = cones[at(open.mesh.vertex_origin[v])] * kQuarterTurn;
  for (std::size_t h = 0; h < flags.size(); ++h) {
    const auto c = static_cast<HalfedgeId>(h);
    if (flags[h]) open.angle[at(open.mesh.faces(c / 3, c % 3))] = 2.0 * kQuarterTurn;
  }
  for (const CutSegment& segment : segments.segments) {
    const HalfedgeId h = side_halfedges(cut, adjacency, segment.sides.front()).front();
    open.angle[at(open.mesh.faces(h / 3, h % 3))] = kQuarterTurn;
  }
  return open;
}

}  // namespace flipfree::seamless
