#include "flipfree/certify/overlap.h"

#include <CGAL/box_intersection_d.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
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
    t.at[static_cast<std::size_t>(k)] = p;
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

// The triangles of one chart in a tree of boxes, halved at the median of the longer side.
class Tree {
 public:
  explicit Tree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    nodes_.reserve(triangles_.size());
    build(0, triangles_.size());
  }

  std::optional<std::pair<FaceId, FaceId>> meets(const Tree& other) const {
    return meets(0, other, 0);
  }

 private:
  static constexpr std::size_t kLeaf = 4;
  struct Node {
    Box box;
    std::size_t begin, end;
    std::size_t left = 0, right = 0;  // 0: a leaf
  };

  std::size_t build(std::size_t begin, std::size_t end) {
    const std::size_t at = nodes_.size();
    nodes_.push_back({{}, begin, end});
    for (std::size_t i = begin; i < end; ++i) nodes_[at].box.extend(triangles_[i].box);
    if (end - begin <= kLeaf) return at;
    const Vector2 extent = nodes_[at].box.sizes();
    const int axis = extent.x() >= extent.y() ? 0 : 1;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto place = [&](std::size_t i) {
      return triangles_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(place(begin), place(middle), place(end),
                     [&](const Triangle& p, const Triangle& q) {
                       const double x = p.box.min()[axis] + p.box.max()[axis];
                       const double y = q.box.min()[axis] + q.box.max()[axis];
                       return x != y ? x < y : p.face < q.face;
                     });
    const std::size_t left = build(begin, middle);
    const std::size_t right = build(middle, end);
    nodes_[at].left = left;
    nodes_[at].right = right;
    return at;
  }

  std::optional<std::pair<FaceId, FaceId>> meets(std::size_t own, const Tree& other,
                                                 std::size_t its) const {
    const Node& p = nodes_[own];
    const Node& q = other.nodes_[its];
    if (!share_area(p.box, q.box)) return std::nullopt;
    if (p.left == 0 && q.left == 0) {
      for (std::size_t i = p.begin; i < p.end; ++i) {
        for (std::size_t j = q.begin; j < q.end; ++j) {
          if (interiors_meet(triangles_[i], other.triangles_[j]))
            return std::pair{triangles_[i].face, other.triangles_[j].face};
        }
      }
      return std::nullopt;
    }
    const bool split_own = q.left == 0 || (p.left != 0 && p.end - p.begin >= q.end - q.begin);
    if (split_own) {
      const auto found = meets(p.left, other, its);
      return found ? found : meets(p.right, other, its);
    }
    const auto found = meets(own, other, q.left);
    return found ? found : meets(own, other, q.right);
  }

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace

IslandOverlaps island_overlaps(const mesh::Components& charts, const Points2& corner_uv) {
  IslandOverlaps result;
  const auto count = static_cast<std::size_t>(charts.count);
  if (count < 2) return result;
  std::vector<Box> bounds(count);
  std::vector<std::vector<FaceId>> faces(count);
  for (std::size_t f = 0; f < charts.of_face.size(); ++f) {
    const auto c = static_cast<std::size_t>(charts.of_face[f]);
    faces[c].push_back(static_cast<FaceId>(f));
    for (Index k = 0; k < 3; ++k) {
      const Vector2 p = corner_uv.row(3 * static_cast<Eigen::Index>(f) + k).transpose();
      if (p.allFinite()) bounds[c].extend(p);
    }
  }
  std::vector<std::optional<Tree>> trees(count);
  const auto tree = [&](std::size_t c) -> const Tree& {
    if (!trees[c]) {
      std::vector<Triangle> triangles;
      triangles.reserve(faces[c].size());
      for (const FaceId f : faces[c]) {
        if (auto t = triangle_of(corner_uv, f)) triangles.push_back(*t);
      }
      trees[c].emplace(std::move(triangles));
    }
    return *trees[c];
  };
  using Bounds = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Box*>;
  std::vector<Bounds> boxes;
  for (Box& box : bounds) {
    if (!box.isEmpty()) boxes.emplace_back(box.min().data(), box.max().data(), &box);
  }
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Bounds& first, const Bounds& second) {
        if (result.pairs >= IslandOverlaps::kMostPairs) return;
        if (!share_area(*first.handle(), *second.handle())) return;
        auto a = static_cast<std::size_t>(first.handle() - bounds.data());
        auto b = static_cast<std::size_t>(second.handle() - bounds.data());
        if (a > b) std::swap(a, b);
        const auto found = tree(a).meets(tree(b));
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
  std::vector<std::vector<Loop>> boundary(static_cast<std::size_t>(charts.count));
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
