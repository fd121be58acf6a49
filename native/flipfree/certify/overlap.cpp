#include "flipfree/certify/overlap.h"

#include <CGAL/box_intersection_d.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/measures.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::certify {

namespace {

using Box = Eigen::AlignedBox2d;

// Boxes that only touch hold no common area.
bool share_area(const Box& a, const Box& b) {
  return (a.intersection(b).sizes().array() > 0.0).all();
}

struct Triangle {
  std::array<Vector2, 3> at;  // counter-clockwise
  Box box;
  FaceId face = kInvalid;
};

std::optional<Triangle> triangle_of(const Points2& corner_uv, FaceId f) {
  Triangle t;
  t.face = f;
  for (Index k = 0; k < 3; ++k) {
    const Vector2 p = corner_uv.row(3 * f + k).transpose();
    if (!p.allFinite()) return std::nullopt;
    t.at[at(k)] = p;
    t.box.extend(p);
  }
  const int turn = numeric::orientation(t.at[0], t.at[1], t.at[2]);
  if (turn == 0) return std::nullopt;
  if (turn < 0) std::swap(t.at[1], t.at[2]);
  return t;
}

// Is all of q on the right of one of p's sides, or on it?
bool separated_by_side(const Triangle& p, const Triangle& q) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2& a = p.at[k];
    const Vector2& b = p.at[(k + 1) % 3];
    if (std::all_of(q.at.begin(), q.at.end(),
                    [&](const Vector2& r) { return numeric::orientation(a, b, r) <= 0; })) {
      return true;
    }
  }
  return false;
}

// Convex sets with disjoint interiors are separated by a line; for polygons, by that of a side.
bool interiors_meet(const Triangle& p, const Triangle& q) {
  return share_area(p.box, q.box) && !separated_by_side(p, q) && !separated_by_side(q, p);
}

// The triangles of one chart, and a tree of their boxes.
namespace bg = boost::geometry;
using Corner = bg::model::d2::point_xy<double>;
using Entry = std::pair<bg::model::box<Corner>, std::size_t>;

bg::model::box<Corner> tree_box(const Box& box) {
  return {{box.min().x(), box.min().y()}, {box.max().x(), box.max().y()}};
}

struct ChartTriangles {
  std::vector<Triangle> triangles;
  bg::index::rtree<Entry, bg::index::quadratic<8>> tree;

  ChartTriangles(const std::vector<FaceId>& faces, const Points2& corner_uv) {
    std::vector<Entry> entries;
    for (const FaceId f : faces) {
      const std::optional<Triangle> t = triangle_of(corner_uv, f);
      if (!t) continue;
      entries.emplace_back(tree_box(t->box), triangles.size());
      triangles.push_back(*t);
    }
    tree = decltype(tree)(entries);  // packed, unlike what grows
  }
};

// Two triangles that share area, one of either chart.
std::optional<std::pair<FaceId, FaceId>> meeting(const ChartTriangles& a, const ChartTriangles& b) {
  if (a.triangles.size() > b.triangles.size()) return meeting(b, a);
  for (const Triangle& t : a.triangles) {
    for (auto found = b.tree.qbegin(bg::index::intersects(tree_box(t.box))); found != b.tree.qend();
         ++found) {
      const Triangle& other = b.triangles[found->second];
      if (interiors_meet(t, other)) return std::pair{t.face, other.face};
    }
  }
  return std::nullopt;
}

// All charts of a map, with trees where they were asked for.
struct PlaneCharts {
  const Points2& corner_uv;
  std::vector<Box> bounds;
  std::vector<std::vector<FaceId>> faces;
  std::vector<std::optional<ChartTriangles>> triangles;

  PlaneCharts(const mesh::Components& charts, const Points2& uv)
      : corner_uv(uv), bounds(at(charts.count)), faces(bounds.size()), triangles(bounds.size()) {
    for (std::size_t f = 0; f < charts.of_face.size(); ++f) {
      const auto c = at(charts.of_face[f]);
      faces[c].push_back(static_cast<FaceId>(f));
      for (Index k = 0; k < 3; ++k) {
        const Vector2 p = corner_uv.row(3 * static_cast<Eigen::Index>(f) + k).transpose();
        if (p.allFinite()) bounds[c].extend(p);
      }
    }
  }

  std::optional<std::pair<FaceId, FaceId>> meeting(std::size_t a, std::size_t b) {
    if (!share_area(bounds[a], bounds[b])) return std::nullopt;
    for (const std::size_t c : {a, b})
      if (!triangles[c]) triangles[c].emplace(faces[c], corner_uv);
    return certify::meeting(*triangles[a], *triangles[b]);
  }
};

}  // namespace

std::function<bool(std::size_t, std::size_t)> sharing_area(const mesh::Components& charts,
                                                           const Points2& corner_uv) {
  return [own = std::make_shared<PlaneCharts>(charts, corner_uv)](std::size_t a, std::size_t b) {
    return own->meeting(a, b).has_value();
  };
}

IslandOverlaps island_overlaps(const mesh::Components& charts, const Points2& corner_uv) {
  IslandOverlaps result;
  if (charts.count < 2) return result;
  PlaneCharts own(charts, corner_uv);
  using Bounds = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Box*>;
  std::vector<Bounds> boxes;
  for (Box& box : own.bounds) {
    if (!box.isEmpty()) boxes.emplace_back(box.min().data(), box.max().data(), &box);
  }
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Bounds& first, const Bounds& second) {
        if (result.pairs >= IslandOverlaps::kMostPairs) return;
        const auto found = own.meeting(at(first.handle() - own.bounds.data()),
                                       at(second.handle() - own.bounds.data()));
        if (!found) return;
        ++result.pairs;
        result.faces.push_back(found->first);
        result.faces.push_back(found->second);
      });
  sort_unique(result.faces);
  // The first of each chart would do to find the charts; so many are enough to show.
  result.faces = first_elements(result.faces);
  return result;
}

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
    Vector2 low = s.a.cwiseMin(s.b), high = s.a.cwiseMax(s.b);
    boxes.emplace_back(low.data(), high.data(), &s);
  }
  std::int64_t contacts = 0;
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Box& first, const Box& second) {
        const Segment& s = *first.handle();
        const Segment& t = *second.handle();
        // Equal points of different vertices count as well: the chart touches itself there.
        const std::pair<VertexId, Vector2> of_s[] = {{s.from, s.a}, {s.to, s.b}};
        const std::pair<VertexId, Vector2> of_t[] = {{t.from, t.a}, {t.to, t.b}};
        bool meet = numeric::segments_conflict(s.a, s.b, t.a, t.b);
        for (const auto& [p, x] : of_s)
          for (const auto& [q, y] : of_t) meet = meet || (p != q && x == y);
        if (!meet) return;
        ++contacts;
        if (named.size() < kMostElements) {
          named.push_back(s.halfedge / 3);
          named.push_back(t.halfedge / 3);
        }
      });
  return contacts;
}

using Loop = std::vector<HalfedgeId>;

// Of one chart. Precondition: its boundary does not meet itself. The outermost loop is that of the
// smallest point.
std::int64_t count_turned_loops(const std::vector<Loop>& loops, const Points2& corner_uv,
                                std::vector<FaceId>& named) {
  const auto place = [&](HalfedgeId h) -> Vector2 { return corner_uv.row(h).transpose(); };
  const auto less = [&](HalfedgeId g, HalfedgeId h) {
    return std::pair(corner_uv(g, 0), corner_uv(g, 1)) <
           std::pair(corner_uv(h, 0), corner_uv(h, 1));
  };
  // In a simple polygon the corner at the lexicographically smallest point is convex and not flat,
  // so it turns as the polygon does.
  std::vector<std::size_t> corner;
  std::size_t outermost = 0;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    corner.push_back(static_cast<std::size_t>(
        std::min_element(loops[l].begin(), loops[l].end(), less) - loops[l].begin()));
    if (less(loops[l][corner[l]], loops[outermost][corner[outermost]])) outermost = l;
  }
  std::int64_t turned = 0;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const Loop& loop = loops[l];
    const HalfedgeId before = loop[(corner[l] + loop.size() - 1) % loop.size()];
    const HalfedgeId here = loop[corner[l]];
    const HalfedgeId after = loop[(corner[l] + 1) % loop.size()];
    if (l == outermost || numeric::orientation(place(before), place(here), place(after)) < 0)
      continue;
    ++turned;
    for (const HalfedgeId h : loop)
      if (named.size() < kMostElements) named.push_back(h / 3);
  }
  return turned;
}

}  // namespace

Overlaps boundary_overlaps(const Triangles& faces, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  const mesh::Components charts = mesh::components_between(adjacency, cuts);
  const mesh::CutMesh cut_mesh = mesh::cut_along(faces, adjacency, cuts);
  const mesh::Adjacency cut_adjacency =
      mesh::build_adjacency(static_cast<Index>(cut_mesh.vertex_origin.size()), cut_mesh.faces);
  std::vector<std::vector<Loop>> boundary(at(charts.count));
  for (Loop& loop : mesh::boundary_halfedge_loops(cut_mesh.faces, cut_adjacency))
    boundary[at(charts.of_face[at(loop.front() / 3)])].push_back(std::move(loop));
  Overlaps overlaps;
  for (const std::vector<Loop>& loops : boundary) {
    std::vector<Segment> segments;
    for (const Loop& loop : loops) {
      for (const HalfedgeId h : loop) {
        segments.push_back({h, mesh::source(cut_mesh.faces, h), mesh::target(cut_mesh.faces, h),
                            corner_uv.row(h).transpose(),
                            corner_uv.row(next_corner(h)).transpose()});
      }
    }
    const std::int64_t contacts = count_contacts(segments, overlaps.faces);
    overlaps.contacts += contacts;
    if (contacts == 0)
      overlaps.turned_loops += count_turned_loops(loops, corner_uv, overlaps.faces);
  }
  sort_unique(overlaps.faces);
  return overlaps;
}

}  // namespace flipfree::certify
