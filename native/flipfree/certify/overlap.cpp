#include "flipfree/certify/overlap.h"

#include <CGAL/box_intersection_d.h>

#include <algorithm>

#include "flipfree/mesh/topology.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

// The chart of every face: faces joined across uncut edges.
Components charts_of(const Adjacency& adjacency, const EdgeFlags& cuts) {
  Adjacency separated = adjacency;
  for (std::size_t h = 0; h < cuts.size(); ++h) {
    if (cuts[h]) separated.opposite[h] = kInvalid;
  }
  return face_components(separated);
}

struct Segment {
  HalfedgeId halfedge;
  VertexId from, to;  // ends as vertices of the cut mesh
};

}  // namespace

Overlaps boundary_overlaps(const Triangles& faces, const Adjacency& adjacency,
                           const EdgeFlags& cuts, const Points2& corner_uv) {
  const Components charts = charts_of(adjacency, cuts);
  const CutMesh cut_mesh = cut_along(faces, adjacency, cuts);
  std::vector<std::vector<Segment>> boundary(static_cast<std::size_t>(charts.count));
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid &&
        !cuts[static_cast<std::size_t>(h)])
      continue;
    const HalfedgeId n = next_corner(h);
    boundary[static_cast<std::size_t>(charts.of_face[static_cast<std::size_t>(h / 3)])].push_back(
        {h, cut_mesh.faces(h / 3, h % 3), cut_mesh.faces(n / 3, n % 3)});
  }

  Overlaps overlaps;
  using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Segment*>;
  for (const std::vector<Segment>& segments : boundary) {
    std::vector<Box> boxes;
    boxes.reserve(segments.size());
    for (const Segment& s : segments) {
      const Vector2 a = corner_uv.row(s.halfedge);
      const Vector2 b = corner_uv.row(next_corner(s.halfedge));
      double low[2] = {std::min(a.x(), b.x()), std::min(a.y(), b.y())};
      double high[2] = {std::max(a.x(), b.x()), std::max(a.y(), b.y())};
      boxes.emplace_back(low, high, &s);
    }
    const auto test = [&](const Box& first, const Box& second) {
      const Segment& s = *first.handle();
      const Segment& t = *second.handle();
      // The two sides of an edge that is marked as a cut but was not opened (one cut vertex at both
      // ends) coincide.
      if (s.from == t.to && s.to == t.from) return;
      const Vector2 a = corner_uv.row(s.halfedge);
      const Vector2 b = corner_uv.row(next_corner(s.halfedge));
      const Vector2 c = corner_uv.row(t.halfedge);
      const Vector2 d = corner_uv.row(next_corner(t.halfedge));
      // Equal points of different vertices count as well: the chart touches itself there.
      const auto touch = [](VertexId p, VertexId q, const Vector2& x, const Vector2& y) {
        return p != q && x == y;
      };
      if (!segments_conflict(a, b, c, d) && !touch(s.from, t.from, a, c) &&
          !touch(s.from, t.to, a, d) && !touch(s.to, t.from, b, c) && !touch(s.to, t.to, b, d)) {
        return;
      }
      ++overlaps.pairs;
      if (overlaps.faces.size() < 1000) {
        overlaps.faces.push_back(s.halfedge / 3);
        overlaps.faces.push_back(t.halfedge / 3);
      }
    };
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), test);
  }
  std::sort(overlaps.faces.begin(), overlaps.faces.end());
  overlaps.faces.erase(std::unique(overlaps.faces.begin(), overlaps.faces.end()),
                       overlaps.faces.end());
  return overlaps;
}

}  // namespace flipfree
