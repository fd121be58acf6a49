#include "flipfree/matchmaker/mesh_overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/matchmaker/curve_overlay.h"
#include "flipfree/matchmaker/untangle.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

double cross(const Vector2& a, const Vector2& b) { return a.x() * b.y() - a.y() * b.x(); }

class Overlay {
 public:
  Overlay(RefinedMap& map, const PlaneMap& plane)
      : surface_(map.surface), mesh_(surface_.mesh), plane_(plane), id_(plane.vertex) {
    for (Eigen::Index v = 0; v < map.uv.rows(); ++v) place_.push_back(map.uv.row(v).transpose());
  }

  bool run(RefinedMap& map, ExecutionContext& context) {
    const std::vector<VertexId> inside = insert_all();
    if (failed_) return false;
    const Mesh base = mesh_;
    CurveOverlay curves(surface_);
    cut_.resize(at(base.halfedge_slots()));
    after_ = follow(inside);
    Index steps = 0;
    for (FaceId f = 0; f < plane_.faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        const VertexId a = plane_.faces(f, k);
        const VertexId b = plane_.faces(f, (k + 1) % 3);
        if (a > b || on_boundary(base, a, b)) continue;  // the other side has it, or nothing to do
        if (++steps % 64 == 0) context.check();
        if (!lay(base, curves, a, b)) return false;
      }
    }
    curves.finish();
    map.uv.resize(static_cast<Eigen::Index>(after_.size()), 2);
    for (std::size_t v = 0; v < after_.size(); ++v)
      map.uv.row(static_cast<Eigen::Index>(v)) = after_[v].transpose();
    return find_flips(mesh_.faces(), map.uv, context).empty();
  }

 private:
  struct Cut {
    double t;  // along the base edge
    VertexId vertex;
  };

  const Vector2& place(VertexId v) const { return place_[at(v)]; }
  Vector2 before(VertexId v) const { return plane_.before.row(v).transpose(); }
  Vector2 after(VertexId v) const { return plane_.after.row(v).transpose(); }

  bool on_boundary(const Mesh& base, VertexId a, VertexId b) const {
    const HalfedgeId h = base.find(id_[at(a)], id_[at(b)]);
    return h != kInvalid && base.is_boundary(h);
  }

  // Vertices of `plane` that the mesh does not have become some; returns which are new.
  std::vector<VertexId> insert_all() {
    std::vector<VertexId> fresh;
    Points2 points(plane_.before.rows(), 2);
    Index count = 0;
    for (VertexId v = 0; v < plane_.before.rows(); ++v) {
      if (plane_.vertex[at(v)] != kInvalid) continue;
      points.row(count++) = plane_.before.row(v);
      fresh.push_back(v);
    }
    std::vector<FaceId> slots;
    const Triangles faces = mesh_.faces(&slots);
    Points2 uv(static_cast<Eigen::Index>(place_.size()), 2);
    for (std::size_t v = 0; v < place_.size(); ++v)
      uv.row(static_cast<Eigen::Index>(v)) = place_[v].transpose();
    const std::vector<FaceId> face = locate_points(points.topRows(count), faces, uv);
    std::vector<std::vector<VertexId>> inside(static_cast<std::size_t>(faces.rows()));
    for (std::size_t i = 0; i < fresh.size(); ++i) {
      failed_ = failed_ || face[i] == kInvalid;
      if (face[i] != kInvalid) inside[at(face[i])].push_back(fresh[i]);
    }
    for (std::size_t f = 0; f < inside.size(); ++f) insert(slots[f], inside[f]);
    return fresh;
  }

  // Puts vertices into a face, the first one, then the others into the parts.
  void insert(FaceId f, const std::vector<VertexId>& inside) {
    if (inside.empty() || failed_) return;
    const Mesh::Triangle c = mesh_.corners(f);
    const Vector2 p = before(inside.front());
    std::array<double, 3> share{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2& a = place(c[(k + 1) % 3]);
      const Vector2& b = place(c[(k + 2) % 3]);
      failed_ = failed_ || orientation(a, b, p) <= 0;
      share[k] = cross(a - p, b - p);
    }
    const auto support = [&](std::size_t k) { return surface_.support[at(c[k])]; };
    const Support on_edge =
        rounded_between(support(0), support(1), share[1] / (share[0] + share[1]));
    const Support where = rounded_between(support(2), on_edge,
                                          (share[0] + share[1]) / (share[0] + share[1] + share[2]));
    for (std::size_t k = 0; k < 3; ++k) {
      failed_ = failed_ || surface_.orientation_in_parent(mesh_.parent(f), support(k),
                                                          support((k + 1) % 3), where) <= 0;
    }
    if (failed_) return;
    const VertexId v = surface_.split_face(f, where);
    id_[at(inside.front())] = v;
    place_.push_back(p);
    for (const FaceId part : mesh_.star(v)) {
      const Mesh::Triangle t = mesh_.corners(part);
      std::vector<VertexId> rest;
      for (std::size_t i = 1; i < inside.size(); ++i) {
        const Vector2 q = before(inside[i]);
        if (orientation(place(t[0]), place(t[1]), q) >= 0 &&
            orientation(place(t[1]), place(t[2]), q) >= 0 &&
            orientation(place(t[2]), place(t[0]), q) >= 0)
          rest.push_back(inside[i]);
      }
      insert(part, rest);
    }
  }

  // Where the mesh's own vertices go.
  std::vector<Vector2> follow(const std::vector<VertexId>& inside) const {
    std::vector<Vector2> result(place_.size(), Vector2(0, 0));
    const auto own = static_cast<Eigen::Index>(place_.size() - inside.size());
    Points2 points(own, 2);
    for (Eigen::Index v = 0; v < own; ++v)
      points.row(v) = place_[static_cast<std::size_t>(v)].transpose();
    const std::vector<FaceId> face = locate_points(points, plane_.faces, plane_.before);
    for (std::size_t v = 0; v < face.size(); ++v) {
      if (face[v] == kInvalid) continue;  // beside the boundary by rounding, and named below
      const auto corner = [&](Index k) { return plane_.faces(face[v], k); };
      const Vector2 a = before(corner(0));
      const double whole = cross(before(corner(1)) - a, before(corner(2)) - a);
      const double s = cross(place_[v] - a, before(corner(2)) - a) / whole;
      const double t = cross(before(corner(1)) - a, place_[v] - a) / whole;
      result[v] = after(corner(0)) + s * (after(corner(1)) - after(corner(0))) +
                  t * (after(corner(2)) - after(corner(0)));
    }
    for (VertexId v = 0; v < plane_.before.rows(); ++v) result[at(id_[at(v)])] = after(v);
    return result;
  }

  // Lays the edge from a to b over the mesh.
  bool lay(const Mesh& base, CurveOverlay& curves, VertexId a, VertexId b) {
    const VertexId goal = id_[at(b)];
    VertexId here = id_[at(a)];
    if (base.find(here, goal) != kInvalid) return curves.reach(here, goal, 0);
    const Vector2 p = place(here);
    const Vector2 q = place(goal);
    HalfedgeId h = kInvalid;
    base.for_each_outgoing(here, [&](HalfedgeId g) {
      if (orientation(p, place(base.target(g)), q) > 0 &&
          orientation(p, place(base.apex(g)), q) < 0)
        h = next_corner(g);
    });
    while (h != kInvalid) {
      // The edge runs from the right of the way to its left.
      const Vector2& r = place(base.source(h));
      const Vector2& l = place(base.target(h));
      const double right = cross(q - p, r - p);
      const double left = cross(q - p, l - p);
      const double first = cross(l - r, p - r);
      const double last = cross(l - r, q - r);
      const double s = std::clamp(first / (first - last), 0.0, 1.0);
      here = cross_edge(base, curves, here, h, right / (right - left));
      if (here == kInvalid) return false;
      after_.push_back(after(a) + s * (after(b) - after(a)));
      if (base.is_boundary(h)) return false;
      h = base.opposite(h);
      const VertexId c = base.apex(h);
      if (c == goal) return curves.reach(here, goal, 0);
      const int side = orientation(p, q, place(c));
      if (side == 0) return false;
      h = side > 0 ? next_corner(h) : previous_corner(h);
    }
    return false;
  }

  VertexId cross_edge(const Mesh& base, CurveOverlay& curves, VertexId here, HalfedgeId h,
                      double t) {
    const HalfedgeId edge = base.edge(h);
    if (edge != h) t = 1 - t;
    std::vector<Cut>& cuts = cut_[at(edge)];
    const auto found =
        std::lower_bound(cuts.begin(), cuts.end(), t,
                         [](const Cut& cut, double value) { return cut.t < value; }) -
        cuts.begin();
    const auto count = static_cast<std::ptrdiff_t>(cuts.size());
    // Where cuts are too close together for rounding to tell their order, one of the pieces beside
    // fits.
    for (const std::ptrdiff_t i : {found, found - 1, found + 1}) {
      if (i < 0 || i > count) continue;
      const VertexId from =
          i == 0 ? base.source(edge) : cuts[static_cast<std::size_t>(i - 1)].vertex;
      const VertexId to = i == count ? base.target(edge) : cuts[static_cast<std::size_t>(i)].vertex;
      const VertexId fresh = curves.cross(here, from, to, 0);
      if (fresh == kInvalid) continue;
      cuts.insert(cuts.begin() + i, {t, fresh});
      return fresh;
    }
    return kInvalid;
  }

  RefinedSurface& surface_;
  Mesh& mesh_;
  const PlaneMap& plane_;
  std::vector<VertexId> id_;    // of the plane's vertices in the mesh
  std::vector<Vector2> place_;  // of the mesh's vertices, before
  std::vector<Vector2> after_;
  std::vector<std::vector<Cut>> cut_;  // by base edge, in order
  bool failed_ = false;
};

}  // namespace

bool follow_by(RefinedMap& map, const PlaneMap& plane, ExecutionContext& context) {
  RefinedMap trial = map;
  if (!Overlay(trial, plane).run(trial, context)) return false;
  map = std::move(trial);
  return true;
}

std::vector<FaceId> locate_points(const Points2& points, const Triangles& faces,
                                  const Points2& place) {
  const auto count = static_cast<std::size_t>(points.rows());
  const auto side = static_cast<Index>(std::ceil(std::sqrt(static_cast<double>(count))));
  const Vector2 low = points.colwise().minCoeff().transpose();
  const Vector2 high = points.colwise().maxCoeff().transpose();
  const auto cell = [&](const Vector2& p, int axis) {
    const double share = (p[axis] - low[axis]) / std::max(high[axis] - low[axis], 1e-300);
    return std::clamp(static_cast<Index>(std::clamp(share, 0.0, 1.0) * side), Index{0}, side - 1);
  };
  std::vector<std::vector<Index>> bucket(at(side * side));
  for (std::size_t i = 0; i < count; ++i) {
    const Vector2 p = points.row(static_cast<Eigen::Index>(i)).transpose();
    bucket[at(cell(p, 1) * side + cell(p, 0))].push_back(static_cast<Index>(i));
  }
  std::vector<FaceId> result(count, kInvalid);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const auto corner = [&](Index k) -> Vector2 { return place.row(faces(f, k)).transpose(); };
    const Vector2 a = corner(0);
    const Vector2 b = corner(1);
    const Vector2 c = corner(2);
    const Vector2 least = a.cwiseMin(b).cwiseMin(c);
    const Vector2 most = a.cwiseMax(b).cwiseMax(c);
    for (Index y = cell(least, 1); y <= cell(most, 1); ++y) {
      for (Index x = cell(least, 0); x <= cell(most, 0); ++x) {
        for (const Index i : bucket[at(y * side + x)]) {
          const Vector2 p = points.row(i).transpose();
          if (result[at(i)] == kInvalid && orientation(a, b, p) >= 0 && orientation(b, c, p) >= 0 &&
              orientation(c, a, p) >= 0)
            result[at(i)] = f;
        }
      }
    }
  }
  return result;
}

}  // namespace flipfree
