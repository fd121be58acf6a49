#include "flipfree/matchmaker/mesh_overlay.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/matchmaker/target_domain.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

class Overlay {
 public:
  Overlay(mesh::RefinedMap& map, const PlaneMap& plane)
      : surface_(map.surface),
        mesh_(surface_.mesh),
        plane_(plane),
        id_(plane.vertex),
        place_(points_of(map.uv)) {}

  bool run(mesh::RefinedMap& map, ExecutionContext& context) {
    for (VertexId v = 0; v < plane_.before.rows(); ++v) {
      if (id_[at(v)] == kInvalid && !insert(v)) return false;
    }
    const Mesh base = mesh_;
    mesh::CurveOverlay curves(surface_);
    after_ = follow(context);
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
    map.uv = rows_of(after_);
    return distortion::is_flip_free(mesh_.faces(), map.uv, context);
  }

 private:
  const Vector2& place(VertexId v) const { return place_[at(v)]; }
  Vector2 before(VertexId v) const { return plane_.before.row(v).transpose(); }
  Vector2 after(VertexId v) const { return plane_.after.row(v).transpose(); }

  bool on_boundary(const Mesh& base, VertexId a, VertexId b) const {
    const HalfedgeId h = base.find(id_[at(a)], id_[at(b)]);
    return h != kInvalid && base.is_boundary(h);
  }

  // The face that holds a point, kInvalid if none does.
  FaceId find_face(const Vector2& p) const {
    for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
      if (!mesh_.alive(f)) continue;
      const auto [i, j, k] = mesh_.corners(f);
      const Vector2 &a = place(i), &b = place(j), &c = place(k);
      const Eigen::AlignedBox2d box(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
      // What lies next to the face is within its reach.
      if (box.exteriorDistance(p) <= kOnLine * box.diagonal().norm() && side_of(a, b, p) >= 0 &&
          side_of(b, c, p) >= 0 && side_of(c, a, p) >= 0)
        return f;
    }
    return kInvalid;
  }

  // A vertex of `plane` that the mesh does not have becomes one, or is one that lies there. False
  // where the surface's own faces are too thin for it.
  bool insert(VertexId v) {
    const Vector2 p = before(v);
    const FaceId f = find_face(p);
    if (f == kInvalid) return false;
    const Mesh::Triangle c = mesh_.corners(f);
    std::array<double, 3> share{};
    HalfedgeId on = kInvalid;  // the edge that it lies on
    Index zeros = 0;
    for (Index k = 0; k < 3; ++k) {
      const Vector2& a = place(mesh_.source(3 * f + k));
      const Vector2& b = place(mesh_.target(3 * f + k));
      share[at((k + 2) % 3)] = cross(a - p, b - p);
      if (side_of(a, b, p) > 0) continue;
      on = 3 * f + k;
      ++zeros;
    }
    if (zeros == 2) {
      // It is the vertex with the greatest share.
      id_[at(v)] = c[at(std::max_element(share.begin(), share.end()) - share.begin())];
      return true;
    }
    const auto support = [&](VertexId w) { return surface_.support[at(w)]; };
    VertexId fresh = kInvalid;
    if (zeros == 1) {
      const double t = (p - place(mesh_.source(on))).norm() /
                       (place(mesh_.target(on)) - place(mesh_.source(on))).norm();
      const mesh::Support where =
          mesh::rounded_between(support(mesh_.source(on)), support(mesh_.target(on)), t);
      if (mesh_.is_boundary(on) || !divides(surface_, on, where) ||
          !divides(surface_, mesh_.opposite(on), where))
        return false;
      fresh = surface_.split_edge(on, where);
    } else {
      const mesh::Support on_edge =
          mesh::rounded_between(support(c[0]), support(c[1]), share[1] / (share[0] + share[1]));
      const mesh::Support where = mesh::rounded_between(
          support(c[2]), on_edge, (share[0] + share[1]) / (share[0] + share[1] + share[2]));
      for (std::size_t k = 0; k < 3; ++k) {
        if (surface_.orientation_in_parent(mesh_.parent(f), support(c[k]), support(c[(k + 1) % 3]),
                                           where) <= 0)
          return false;
      }
      fresh = surface_.split_face(f, where);
    }
    id_[at(v)] = fresh;
    place_.push_back(p);
    return true;
  }

  // Where the vertices go as they lie in the plane's triangles.
  std::vector<Vector2> follow(const ExecutionContext& context) const {
    const auto count = static_cast<Index>(plane_.before.rows());
    const TargetDomain domain{
        Mesh(count, plane_.faces), points_of(plane_.before), id_,
        mesh::boundary_loops(plane_.faces, mesh::build_adjacency(count, plane_.faces)).front()};
    const Points2 places = rows_of(place_);
    Polygon result = points_of(
        Carrier(surface_, places, domain, domain.point, context).vertices(points_of(plane_.after)));
    for (VertexId v = 0; v < count; ++v) result[at(id_[at(v)])] = after(v);
    return result;
  }

  // Lays the edge from a to b over the mesh; mesh vertices that it passes through become part of
  // it.
  bool lay(const Mesh& base, mesh::CurveOverlay& curves, VertexId a, VertexId b) {
    const VertexId goal = id_[at(b)];
    const Vector2 p = place(id_[at(a)]);
    const Vector2 q = place(goal);
    VertexId here = id_[at(a)];
    HalfedgeId h = kInvalid;  // to be crossed next
    for (VertexId passed = here; passed != kInvalid;) {
      if (passed != here && !curves.reach(here, passed, 0)) return false;
      if (passed == goal) return true;
      if (passed != here) {
        const double s = (place(passed) - p).norm() / (q - p).norm();
        after_[at(passed)] = after(a) + s * (after(b) - after(a));
      }
      here = passed;
      passed = kInvalid;
      h = kInvalid;
      base.for_each_outgoing(here, [&](HalfedgeId g) {
        const Vector2& first = place(base.target(g));
        const int side = side_of(p, q, first);
        const bool ahead = (q - p).dot(first - place(here)) > 0;
        if (side == 0 && ahead) passed = base.target(g);
        // The face at g holds the way if its far edge leads from the right of it to its left, and
        // not behind: faces have angles of less than half a turn.
        if (side < 0 && side_of(p, q, place(base.apex(g))) > 0) h = next_corner(g);
      });
      while (passed == kInvalid) {
        if (h == kInvalid || base.is_boundary(h)) return false;
        here = cross_edge(base, curves, here, h, a, b);
        if (here == kInvalid) return false;
        h = base.opposite(h);
        const VertexId c = base.apex(h);
        const int side = side_of(p, q, place(c));
        if (side == 0) passed = c;
        h = side > 0 ? next_corner(h) : previous_corner(h);
      }
    }
    return false;
  }

  // Continues the edge from a to b across h.
  VertexId cross_edge(const Mesh& base, mesh::CurveOverlay& curves, VertexId here, HalfedgeId h,
                      VertexId a, VertexId b) {
    const HalfedgeId edge = base.edge(h);
    const Vector2& p = place(id_[at(a)]);
    const Vector2& q = place(id_[at(b)]);
    const Vector2& r = place(base.source(edge));
    const Vector2& l = place(base.target(edge));
    const double right = cross(q - p, r - p);
    const double t = right / (right - cross(q - p, l - p));
    const double first = cross(l - r, p - r);
    const double s = std::clamp(first / (first - cross(l - r, q - r)), 0.0, 1.0);
    const VertexId fresh = curves.cross_at(here, base.source(edge), base.target(edge), t, 0);
    if (fresh != kInvalid) after_.push_back(after(a) + s * (after(b) - after(a)));
    return fresh;
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_;
  const PlaneMap& plane_;
  std::vector<VertexId> id_;    // of the plane's vertices in the mesh
  std::vector<Vector2> place_;  // of the mesh's vertices, before
  std::vector<Vector2> after_;
};

}  // namespace

bool divides(const mesh::RefinedSurface& surface, HalfedgeId h, const mesh::Support& where) {
  const auto support = [&](VertexId v) { return surface.support[at(v)]; };
  const mesh::Support apex = support(surface.mesh.apex(h));
  const FaceId parent = surface.mesh.parent(h / 3);
  return surface.orientation_in_parent(parent, support(surface.mesh.source(h)), where, apex) > 0 &&
         surface.orientation_in_parent(parent, where, support(surface.mesh.target(h)), apex) > 0;
}

bool PlaneMap::valid(const ExecutionContext& context) const {
  return distortion::is_flip_free(faces, before, context) &&
         distortion::is_flip_free(faces, after, context);
}

mesh::Surface flat_surface(const Triangles& faces, const Points2& places) {
  mesh::Surface flat{Points3::Zero(places.rows(), 3), faces};
  flat.vertices.leftCols(2) = places;
  return flat;
}

bool follow_by(mesh::RefinedMap& map, const PlaneMap& plane, ExecutionContext& context) {
  mesh::RefinedMap trial = map;
  if (!Overlay(trial, plane).run(trial, context)) return false;
  map = std::move(trial);
  return true;
}

}  // namespace flipfree::matchmaker
