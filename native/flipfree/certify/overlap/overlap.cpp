#include "flipfree/certify/overlap/overlap.h"

#include <CGAL/box_intersection_d.h>

#include <algorithm>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/elements.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::certify {
namespace {

struct Segment {
  HalfedgeId halfedge;
  VertexId from, to;  // ends as vertices of the cut mesh
  Vector2 a, b;       // their places
};

std::int64_t count_contacts(const std::vector<Segment>& segments, std::vector<FaceId>& named) {
  using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Segment*>;
  std::vector<Box> boxes;
  boxes.reserve(segments.size());
  for (const Segment& s : segments) {
    double low[2] = {std::min(s.a.x(), s.b.x()), std::min(s.a.y(), s.b.y())};
    double high[2] = {std::max(s.a.x(), s.b.x()), std::max(s.a.y(), s.b.y())};
    boxes.emplace_back(low, high, &s);
  }
  std::int64_t contacts = 0;
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Box& first, const Box& second) {
        const Segment& s = *first.handle();
        const Segment& t = *second.handle();
        // Equal points of different vertices count as well: the chart touches itself there.
        const auto touch = [](VertexId p, VertexId q, const Vector2& x, const Vector2& y) {
          return p != q && x == y;
        };
        if (!numeric::segments_conflict(s.a, s.b, t.a, t.b) && !touch(s.from, t.from, s.a, t.a) &&
            !touch(s.from, t.to, s.a, t.b) && !touch(s.to, t.from, s.b, t.a) &&
            !touch(s.to, t.to, s.b, t.b)) {
          return;
        }
        ++contacts;
        if (named.size() < kMostElements) {
          named.push_back(s.halfedge / 3);
          named.push_back(t.halfedge / 3);
        }
      });
  return contacts;
}

bool lexicographically_less(const Vector2& p, const Vector2& q) {
  return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
}

// The chart's boundary as loops: indices into `segments`, which are sorted by `from`.
std::vector<std::vector<std::size_t>> loops_of(const std::vector<Segment>& segments) {
  std::vector<std::vector<std::size_t>> loops;
  std::vector<char> seen(segments.size(), 0);
  for (std::size_t start = 0; start < segments.size(); ++start) {
    if (seen[start]) continue;
    std::vector<std::size_t>& loop = loops.emplace_back();
    for (std::size_t i = start; !seen[i];) {
      seen[i] = 1;
      loop.push_back(i);
      // Every cut vertex has one outgoing boundary half-edge: it stands for one fan of faces.
      i = static_cast<std::size_t>(
          std::lower_bound(segments.begin(), segments.end(), segments[i].to,
                           [](const Segment& s, VertexId v) { return s.from < v; }) -
          segments.begin());
    }
  }
  return loops;
}

// In a simple polygon the corner at the lexicographically smallest point is convex and not flat, so
// it turns as the polygon does.
std::size_t extreme_corner(const std::vector<Segment>& segments,
                           const std::vector<std::size_t>& loop) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < loop.size(); ++i) {
    if (lexicographically_less(segments[loop[i]].a, segments[loop[best]].a)) best = i;
  }
  return best;
}

// Precondition: the segments do not meet. The outermost loop is that of the smallest point.
std::int64_t count_turned_loops(std::vector<Segment>& segments, std::vector<FaceId>& named) {
  std::sort(segments.begin(), segments.end(),
            [](const Segment& s, const Segment& t) { return s.from < t.from; });
  const std::vector<std::vector<std::size_t>> loops = loops_of(segments);
  if (loops.size() < 2) return 0;
  std::vector<std::size_t> corner;
  std::size_t outermost = 0;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    corner.push_back(extreme_corner(segments, loops[l]));
    if (lexicographically_less(segments[loops[l][corner[l]]].a,
                               segments[loops[outermost][corner[outermost]]].a)) {
      outermost = l;
    }
  }
  std::int64_t turned = 0;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    if (l == outermost) continue;
    const Segment& after = segments[loops[l][corner[l]]];
    const Segment& before = segments[loops[l][(corner[l] + loops[l].size() - 1) % loops[l].size()]];
    if (numeric::orientation(before.a, after.a, after.b) < 0) continue;
    ++turned;
    for (const std::size_t i : loops[l]) {
      if (named.size() < kMostElements) named.push_back(segments[i].halfedge / 3);
    }
  }
  return turned;
}

}  // namespace

mesh::Components charts_of(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts) {
  mesh::Adjacency separated = adjacency;
  for (std::size_t h = 0; h < cuts.size(); ++h) {
    if (cuts[h]) separated.opposite[h] = kInvalid;
  }
  return mesh::face_components(separated);
}

Overlaps boundary_overlaps(const Triangles& faces, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  const mesh::Components charts = charts_of(adjacency, cuts);
  const mesh::CutMesh cut_mesh = mesh::cut_along(faces, adjacency, cuts);
  std::vector<std::vector<Segment>> boundary(static_cast<std::size_t>(charts.count));
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid &&
        !cuts[static_cast<std::size_t>(h)])
      continue;
    const HalfedgeId n = next_corner(h);
    boundary[static_cast<std::size_t>(charts.of_face[static_cast<std::size_t>(h / 3)])].push_back(
        {h, cut_mesh.faces(h / 3, h % 3), cut_mesh.faces(n / 3, n % 3),
         corner_uv.row(h).transpose(), corner_uv.row(n).transpose()});
  }
  Overlaps overlaps;
  for (std::vector<Segment>& segments : boundary) {
    const std::int64_t contacts = count_contacts(segments, overlaps.faces);
    overlaps.contacts += contacts;
    if (contacts == 0) overlaps.turned_loops += count_turned_loops(segments, overlaps.faces);
  }
  std::sort(overlaps.faces.begin(), overlaps.faces.end());
  overlaps.faces.erase(std::unique(overlaps.faces.begin(), overlaps.faces.end()),
                       overlaps.faces.end());
  return overlaps;
}

}  // namespace flipfree::certify
