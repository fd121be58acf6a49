#include "flipfree/matchmaker/target/target_domain.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <deque>
#include <map>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

const Vector2& point_of(const TargetDomain& domain, Index v) { return domain.point[at(v)]; }

// Can the edge be flipped (its two triangles form a strictly convex quadrilateral), and is it not
// locally Delaunay?
bool wants_flip(const TargetDomain& domain, HalfedgeId h) {
  const Mesh& mesh = domain.triangulation;
  if (mesh.is_boundary(h) || mesh.mark(h) != Mesh::kUnmarked) return false;
  const HalfedgeId o = mesh.opposite(h);
  const Vector2& a = point_of(domain, mesh.source(h));
  const Vector2& b = point_of(domain, mesh.target(h));
  const Vector2& c = point_of(domain, mesh.apex(h));
  const Vector2& d = point_of(domain, mesh.apex(o));
  if (numeric::orientation(c, d, b) <= 0 || numeric::orientation(d, c, a) <= 0) return false;
  if (mesh.find(mesh.apex(h), mesh.apex(o)) != kInvalid) return false;
  return numeric::in_circle(a, b, c, d) > 0;
}

}  // namespace

void make_delaunay(TargetDomain& domain) {
  Mesh& mesh = domain.triangulation;
  // Vertex pairs, because flips renumber half-edges.
  std::deque<std::pair<Index, Index>> queue;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (mesh.alive(h / 3) && mesh.edge(h) == h) queue.emplace_back(mesh.source(h), mesh.target(h));
  }
  while (!queue.empty()) {
    const auto [a, b] = queue.front();
    queue.pop_front();
    const HalfedgeId h = mesh.find(a, b);
    if (h == kInvalid || !wants_flip(domain, h)) continue;
    const Index c = mesh.apex(h);
    const Index d = mesh.apex(mesh.opposite(h));
    mesh.flip_edge(h);
    for (const auto& pair : {std::pair(a, c), std::pair(a, d), std::pair(b, c), std::pair(b, d)}) {
      queue.push_back(pair);
    }
  }
}

TargetDomain triangulate_immersed(const Polygon& outline, std::span<const Index> corner_vertex,
                                  Index vertex_count, const Triangles& triangles) {
  TargetDomain domain;
  domain.point.resize(static_cast<std::size_t>(vertex_count));
  domain.mesh_vertex.assign(static_cast<std::size_t>(vertex_count), kInvalid);
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) domain.point[at(corner_vertex[i])] = outline[i];
  Triangles faces = triangles;
  for (Eigen::Index i = 0; i < faces.size(); ++i) {
    faces.data()[i] = corner_vertex[at(faces.data()[i])];
  }
  domain.triangulation = Mesh(vertex_count, faces);
  for (std::size_t i = 0; i < n; ++i) {
    const Index a = corner_vertex[i];
    const Index b = corner_vertex[(i + 1) % n];
    const HalfedgeId h = domain.triangulation.find(a, b);
    if (h == kInvalid)
      throw InternalError("the outline of an immersed target is not in its triangulation");
    domain.triangulation.set_mark(h, TargetDomain::kFixedEdge);
  }
  Index start = kInvalid;
  for (Index v = 0; v < vertex_count && start == kInvalid; ++v) {
    if (domain.triangulation.is_boundary_vertex(v)) start = v;
  }
  for (Index v = start;;) {
    domain.outline.push_back(v);
    v = domain.triangulation.target(domain.triangulation.outgoing(v));
    if (v == start) break;
  }
  make_delaunay(domain);
  return domain;
}

std::vector<FaceId> sheets_at(const TargetDomain& domain, const Vector2& point) {
  const Mesh& mesh = domain.triangulation;
  std::vector<FaceId> sheets;
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f)) continue;
    std::array<int, 3> side{};
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId h = 3 * f + k;
      side[at(k)] = numeric::orientation(point_of(domain, mesh.source(h)),
                                         point_of(domain, mesh.target(h)), point);
    }
    if (*std::min_element(side.begin(), side.end()) < 0) continue;
    bool first = true;
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId h = 3 * f + k;
      const bool on_edge = side[at(k)] == 0;
      if (on_edge && !mesh.is_boundary(h) && mesh.opposite(h) / 3 < f) first = false;
      if (point == point_of(domain, mesh.source(h))) {
        for (const FaceId g : mesh.star(mesh.source(h))) first = first && g >= f;
      }
    }
    if (first) sheets.push_back(f);
  }
  return sheets;
}

Index insert_point(TargetDomain& domain, FaceId sheet, const Vector2& point, VertexId mesh_vertex) {
  Mesh& mesh = domain.triangulation;
  HalfedgeId on_edge = kInvalid;
  for (HalfedgeId h = 3 * sheet; h < 3 * sheet + 3; ++h) {
    if (numeric::orientation(point_of(domain, mesh.source(h)), point_of(domain, mesh.target(h)),
                             point) == 0)
      on_edge = h;
  }
  const Index v = on_edge == kInvalid ? mesh.split_face(sheet) : mesh.split_edge(on_edge);
  domain.point.push_back(point);
  domain.mesh_vertex.push_back(mesh_vertex);
  return v;
}

namespace {

// Union of triangles by dropped edges, walked edge by edge: which half-edges are kept.
class Merger {
 public:
  explicit Merger(const TargetDomain& domain)
      : domain_(domain),
        mesh_(domain.triangulation),
        kept_(static_cast<std::size_t>(mesh_.halfedge_slots()), true) {}

  bool kept(HalfedgeId h) const { return kept_[at(h)]; }

  // Drops the edge if both of its ends stay convex.
  void try_drop(HalfedgeId h) {
    const HalfedgeId o = mesh_.opposite(h);
    if (!convex_without(h) || !convex_without(o)) return;
    kept_[at(h)] = false;
    kept_[at(o)] = false;
  }

 private:
  // At the source of h: is the angle between the kept neighbours of h on both sides at most pi?
  bool convex_without(HalfedgeId h) const {
    Index in = kInvalid;
    for (HalfedgeId g = h;;) {
      const HalfedgeId back = previous_corner(g);
      if (kept(back)) {
        in = mesh_.source(back);
        break;
      }
      g = mesh_.opposite(back);
      if (g == h) return false;
    }
    Index out = kInvalid;
    for (HalfedgeId g = h;;) {
      g = mesh_.rotate_cw(g);
      if (g == kInvalid || g == h) return false;
      if (kept(g)) {
        out = mesh_.target(g);
        break;
      }
    }
    if (in == out) return false;
    const Vector2& v = point_of(domain_, mesh_.source(h));
    const Vector2& e = point_of(domain_, mesh_.target(h));
    const Vector2& p = point_of(domain_, out);
    const Vector2& q = point_of(domain_, in);
    // The angles from out to h and from h to in are at most pi each, so the sign of orientation(v,
    // p, q) tells whether their sum is below pi; if it is exactly pi, the first one is below pi; if
    // 2 pi, both are straight.
    const int side = numeric::orientation(v, p, q);
    if (side > 0) return true;
    return side == 0 && numeric::orientation(v, p, e) > 0;
  }

  const TargetDomain& domain_;
  const Mesh& mesh_;
  std::vector<bool> kept_;
};

// The polygons that kept edges bound.
ConvexPartition partition_by(const TargetDomain& domain, const Merger& merger) {
  const Mesh& mesh = domain.triangulation;
  ConvexPartition partition;
  std::vector<Index> edge_of(static_cast<std::size_t>(mesh.halfedge_slots()), kInvalid);
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (!mesh.alive(h / 3) || mesh.edge(h) != h || !merger.kept(h)) continue;
    edge_of[at(h)] = static_cast<Index>(partition.edges.size());
    if (!mesh.is_boundary(h)) {
      edge_of[at(mesh.opposite(h))] = static_cast<Index>(partition.edges.size());
    }
    partition.edges.push_back(
        {mesh.source(h), mesh.target(h), mesh.is_boundary(h), mesh.mark(h) != Mesh::kUnmarked});
  }
  std::vector<bool> done(edge_of.size(), false);
  for (HalfedgeId first = 0; first < mesh.halfedge_slots(); ++first) {
    if (edge_of[at(first)] == kInvalid || done[at(first)]) continue;
    auto& polygon = partition.polygons.emplace_back();
    HalfedgeId h = first;
    do {
      done[at(h)] = true;
      const Index e = edge_of[at(h)];
      polygon.push_back({e, partition.edges[at(e)].a == mesh.source(h)});
      // A polygon whose edges lead elsewhere would be walked without end.
      if (polygon.size() > edge_of.size())
        throw InternalError("the target's triangulation is not closed around a polygon");
      h = next_corner(h);
      while (edge_of[at(h)] == kInvalid) h = next_corner(mesh.opposite(h));
    } while (h != first);
  }
  partition.around.resize(domain.point.size());
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    auto& list = partition.around[at(v)];
    HalfedgeId last = kInvalid;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      if (edge_of[at(h)] != kInvalid) list.push_back(edge_of[at(h)]);
      last = previous_corner(h);
    });
    if (last != kInvalid && mesh.is_boundary(last)) list.push_back(edge_of[at(last)]);
  }
  return partition;
}

}  // namespace

ConvexPartition merge_convex(const TargetDomain& domain) {
  const Mesh& mesh = domain.triangulation;
  std::vector<HalfedgeId> order;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (mesh.alive(h / 3) && mesh.edge(h) == h && !mesh.is_boundary(h) &&
        mesh.mark(h) == Mesh::kUnmarked) {
      order.push_back(h);
    }
  }
  const auto length = [&](HalfedgeId h) {
    return (point_of(domain, mesh.source(h)) - point_of(domain, mesh.target(h))).squaredNorm();
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](HalfedgeId a, HalfedgeId b) { return length(a) > length(b); });
  Merger merger(domain);
  for (const HalfedgeId h : order) merger.try_drop(h);
  return partition_by(domain, merger);
}

namespace {

// The triangle at the corner, which lies at a, that the segment a -> b enters.
FaceId wedge(const TargetDomain& domain, const std::vector<Vector2>& place, Index corner,
             const Vector2& a, const Vector2& b) {
  const Mesh& mesh = domain.triangulation;
  FaceId found = kInvalid;
  mesh.for_each_outgoing(corner, [&](HalfedgeId h) {
    if (found == kInvalid && numeric::orientation(a, place[at(mesh.target(h))], b) >= 0 &&
        numeric::orientation(a, place[at(mesh.apex(h))], b) <= 0)
      found = h / 3;
  });
  return found;
}

}  // namespace

bool holds(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
           const Vector2& p) {
  const Mesh& mesh = domain.triangulation;
  for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
    if (numeric::orientation(place[at(mesh.source(h))], place[at(mesh.target(h))], p) < 0)
      return false;
  }
  return true;
}

FaceId find_along(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
                  Index corner, const Vector2& a, const Vector2& b) {
  const Mesh& mesh = domain.triangulation;
  HalfedgeId entered = kInvalid;
  if (corner != kInvalid) {
    f = wedge(domain, place, corner, a, b);
    if (f == kInvalid || holds(domain, place, f, b)) return f;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (mesh.apex(h) == corner) entered = mesh.opposite(h);
    }
    if (entered == kInvalid) return kInvalid;
    f = entered / 3;
  }
  // The dual of the domain is a tree and the walk never turns back: no triangle comes twice.
  while (!holds(domain, place, f, b)) {
    HalfedgeId exit = kInvalid;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (h == entered || mesh.is_boundary(h)) continue;
      const Vector2& p = place[at(mesh.source(h))];
      const Vector2& q = place[at(mesh.target(h))];
      if (numeric::orientation(p, q, b) < 0 && numeric::orientation(a, b, p) <= 0 &&
          numeric::orientation(a, b, q) >= 0)
        exit = h;
    }
    if (exit == kInvalid) return kInvalid;
    entered = mesh.opposite(exit);
    f = entered / 3;
  }
  return f;
}

Carrier::Carrier(const mesh::RefinedSurface& surface, const Points2& uv, const TargetDomain& domain,
                 const std::vector<Vector2>& here, const ExecutionContext& context)
    : uv_(uv),
      domain_(domain),
      here_(here),
      face_(static_cast<std::size_t>(uv.rows()), kInvalid),
      corner_(face_.size(), kInvalid) {
  std::deque<VertexId> queue;
  for (const Index d : domain.outline) {
    const VertexId v = domain.mesh_vertex[at(d)];
    corner_[at(v)] = d;
    face_[at(v)] = domain.triangulation.outgoing(d) / 3;
    queue.push_back(v);
  }
  for (std::size_t steps = 0; !queue.empty(); ++steps) {
    if (steps % 4096 == 0) context.check();
    const VertexId v = queue.front();
    queue.pop_front();
    const Vector2 a = uv.row(v).transpose();
    surface.mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      const VertexId w = surface.mesh.target(h);
      FaceId& f = face_[at(w)];
      if (f != kInvalid) return;
      f = find_along(domain, here, face_[at(v)], corner_[at(v)], a, uv.row(w).transpose());
      if (f != kInvalid) queue.push_back(w);  // else another neighbour may find it
    });
  }
}

Vector2 Carrier::ride(FaceId f, const Vector2& p, const std::vector<Vector2>& there) const {
  if (f == kInvalid) return p;
  const Mesh::Triangle t = domain_.triangulation.corners(f);
  const Vector2 &a = here_[at(t[0])], &b = here_[at(t[1])], &c = here_[at(t[2])];
  if (!(twice_area(a, b, c) > 0)) return p;
  const Vector3 w = barycentric(a, b, c, p);
  return w[0] * there[at(t[0])] + w[1] * there[at(t[1])] + w[2] * there[at(t[2])];
}

Points2 Carrier::vertices(const std::vector<Vector2>& there) const {
  Points2 result(uv_.rows(), 2);
  for (Eigen::Index v = 0; v < uv_.rows(); ++v) {
    const auto i = static_cast<std::size_t>(v);
    const Vector2 p = corner_[i] != kInvalid ? there[static_cast<std::size_t>(corner_[i])]
                                             : ride(face_[i], uv_.row(v).transpose(), there);
    result.row(v) = p.transpose();
  }
  return result;
}

}  // namespace flipfree::matchmaker
