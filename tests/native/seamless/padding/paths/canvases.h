// Curves drawn by hand on canvases, and what they enclose, for tests.
#pragma once

#include <set>
#include <vector>

#include "flipfree/seamless/padding/paths.h"
#include "seamless/padding/topology/made_cuts.h"

namespace flipfree::test {

inline std::vector<HalfedgeId> along(const seamless::Canvas& canvas, const Chain& chain) {
  std::vector<HalfedgeId> path;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i)
    path.push_back(canvas.mesh().find(chain[i], chain[i + 1]));
  return path;
}

// Row 0 and column 0 of a grid torus: one disk with four corners.
inline void draw_square(seamless::Canvas& canvas, const GridTorus& torus) {
  Chain row;
  Chain column;
  for (Index i = 0; i <= torus.sectors; ++i) row.push_back(torus.at(i, 0));
  for (Index j = 0; j <= torus.rows; ++j) column.push_back(torus.at(0, j));
  canvas.draw(along(canvas, row), seamless::Curve::kLoop);
  canvas.draw(along(canvas, column), seamless::Curve::kConnector);
}

// Flat but for these.
inline std::vector<Index> cones_at(const mesh::Surface& surface,
                                   const std::vector<std::pair<VertexId, Index>>& given) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  for (const auto& [v, k] : given) cones[static_cast<std::size_t>(v)] = k;
  return cones;
}

// Cones in the component of the surface, cut along what is drawn, that is on the left of h.
inline std::set<VertexId> cones_beside(const seamless::Canvas& canvas, HalfedgeId h) {
  std::set<FaceId> seen = {h / 3};
  std::vector<FaceId> open = {h / 3};
  std::set<VertexId> cones;
  while (!open.empty()) {
    const FaceId f = open.back();
    open.pop_back();
    for (HalfedgeId e = 3 * f; e < 3 * f + 3; ++e) {
      if (canvas.excess(canvas.mesh().source(e)) != 0) cones.insert(canvas.mesh().source(e));
      const FaceId g = canvas.mesh().opposite(e) / 3;
      if (!canvas.is_drawn(e) && seen.insert(g).second) open.push_back(g);
    }
  }
  return cones;
}

// The first edge that joins vertices that are not free and is not drawn, or kInvalid.
inline HalfedgeId unrefined_edge(const seamless::Canvas& canvas) {
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); ++h) {
    if (!canvas.is_drawn(h) && !canvas.is_free(canvas.mesh().source(h)) &&
        !canvas.is_free(canvas.mesh().target(h)))
      return h;
  }
  return kInvalid;
}

}  // namespace flipfree::test
