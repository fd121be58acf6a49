#include "flipfree/matchmaker/target_domain.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_2_algorithms.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <deque>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Index, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Cdt = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
    CGAL::No_constraint_intersection_tag>;

using Mesh = mesh::EditableTriangulation;

// Does a triangle of this triangulation, counter-clockwise, lie inside the outline, of the first n
// vertices? Outside are pockets of the convex hull, whose corners are the outline's in reverse.
bool is_inside(const Mesh::Triangle& t, Index n) {
  const auto [a, b, c] = t;
  return std::max({a, b, c}) >= n || (a < b) + (b < c) + (c < a) == 2;
}

}  // namespace

void TargetDomain::fix(Index a, Index b, Index mark) {
  const HalfedgeId h = triangulation.find(a, b);
  if (h == kInvalid) throw InternalError("a fixed edge is not in the target's triangulation");
  triangulation.set_mark(h, mark);
}

Polygon TargetDomain::outline_points() const {
  Polygon points;
  for (const Index v : outline) points.push_back(at(v));
  return points;
}

TargetDomain triangulate_embedded(const Polygon& outline, std::span<const Vector2> inner,
                                  std::span<const std::pair<Index, Index>> fixed_edges) {
  TargetDomain domain;
  domain.point.assign(outline.begin(), outline.end());
  domain.point.insert(domain.point.end(), inner.begin(), inner.end());
  domain.mesh_vertex.assign(domain.point.size(), kInvalid);
  Cdt cdt;
  std::vector<Cdt::Vertex_handle> handle;
  for (const Vector2& p : domain.point) {
    handle.push_back(cdt.insert({p.x(), p.y()}));
    handle.back()->info() = static_cast<Index>(handle.size()) - 1;
  }
  if (cdt.number_of_vertices() != domain.point.size())
    throw InternalError("target points coincide");
  const auto n = static_cast<Index>(outline.size());
  for (Index i = 0; i < n; ++i) {
    domain.outline.push_back(i);
    cdt.insert_constraint(handle[at(i)], handle[at((i + 1) % n)]);
  }
  for (const auto& [a, b] : fixed_edges) cdt.insert_constraint(handle[at(a)], handle[at(b)]);
  std::vector<Mesh::Triangle> triangles;
  for (const Cdt::Face_handle f : cdt.finite_face_handles())
    triangles.push_back({f->vertex(0)->info(), f->vertex(1)->info(), f->vertex(2)->info()});
  std::erase_if(triangles, [&](const Mesh::Triangle& t) { return !is_inside(t, n); });
  domain.triangulation = Mesh(static_cast<Index>(domain.point.size()), rows_of(triangles));
  for (Index i = 0; i < n; ++i) domain.fix(i, (i + 1) % n);
  Index mark = TargetDomain::kFixedEdge;
  for (const auto& [a, b] : fixed_edges) domain.fix(a, b, ++mark);
  return domain;
}

int locate_in_polygon(const Polygon& polygon, const Vector2& point) {
  std::vector<Kernel::Point_2> corners;
  for (const Vector2& p : polygon) corners.emplace_back(p.x(), p.y());
  return CGAL::bounded_side_2(corners.begin(), corners.end(), Kernel::Point_2(point.x(), point.y()),
                              Kernel());
}

namespace {

// Can the edge be flipped (its two triangles form a strictly convex quadrilateral), and is it not
// locally Delaunay?
bool wants_flip(const TargetDomain& domain, HalfedgeId h) {
  const Mesh& mesh = domain.triangulation;
  if (mesh.is_boundary(h) || mesh.mark(h) != Mesh::kUnmarked) return false;
  const HalfedgeId o = mesh.opposite(h);
  const Vector2& a = domain.at(mesh.source(h));
  const Vector2& b = domain.at(mesh.target(h));
  const Vector2& c = domain.at(mesh.apex(h));
  const Vector2& d = domain.at(mesh.apex(o));
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

std::vector<FaceId> sheets_at(const TargetDomain& domain, const Vector2& point) {
  const Mesh& mesh = domain.triangulation;
  std::vector<FaceId> sheets;
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f) || !holds(domain, domain.point, f, point)) continue;
    bool first = true;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const Vector2& corner = domain.at(mesh.source(h));
      const bool on_edge = numeric::orientation(corner, domain.at(mesh.target(h)), point) == 0;
      if (on_edge && !mesh.is_boundary(h) && mesh.opposite(h) / 3 < f) first = false;
      if (point == corner) {
        for (const FaceId g : mesh.star(mesh.source(h))) first = first && g >= f;
      }
    }
    if (first) sheets.push_back(f);
  }
  return sheets;
}

namespace {

// Of the partition by the half-edges that are kept: is the angle at the source of h between the
// kept neighbours of h on both sides at most pi?
bool convex_without(const TargetDomain& domain, const std::vector<bool>& kept, HalfedgeId h) {
  const Mesh& mesh = domain.triangulation;
  HalfedgeId in = previous_corner(h);
  while (!kept[at(in)]) {
    const HalfedgeId g = mesh.opposite(in);
    if (g == h) return false;
    in = previous_corner(g);
  }
  HalfedgeId out = mesh.rotate_cw(h);
  while (out != kInvalid && out != h && !kept[at(out)]) out = mesh.rotate_cw(out);
  if (out == kInvalid || out == h || mesh.source(in) == mesh.target(out)) return false;
  const Vector2& v = domain.at(mesh.source(h));
  const Vector2& p = domain.at(mesh.target(out));
  // The angles from out to h and from h to in are at most pi each, so the sign of orientation(v,
  // p, q) tells whether their sum is below pi; if it is exactly pi, the first one is below pi; if
  // 2 pi, both are straight.
  const int side = numeric::orientation(v, p, domain.at(mesh.source(in)));
  return side > 0 || (side == 0 && numeric::orientation(v, p, domain.at(mesh.target(h))) > 0);
}

// The polygons that kept edges bound.
ConvexPartition partition_by(const TargetDomain& domain, const std::vector<bool>& kept) {
  const Mesh& mesh = domain.triangulation;
  ConvexPartition partition;
  std::vector<Index> edge_of(at(mesh.halfedge_slots()), kInvalid);
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (!mesh.alive(h / 3) || mesh.edge(h) != h || !kept[at(h)]) continue;
    edge_of[at(h)] = static_cast<Index>(partition.edges.size());
    if (!mesh.is_boundary(h)) {
      edge_of[at(mesh.opposite(h))] = static_cast<Index>(partition.edges.size());
    }
    const Index given = mesh.mark(h) > TargetDomain::kFixedEdge ? mesh.mark(h) - 1 : kInvalid;
    partition.edges.push_back({mesh.source(h), mesh.target(h), mesh.is_boundary(h), given});
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
    return (domain.at(mesh.source(h)) - domain.at(mesh.target(h))).squaredNorm();
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](HalfedgeId a, HalfedgeId b) { return length(a) > length(b); });
  std::vector<bool> kept(at(mesh.halfedge_slots()), true);
  for (const HalfedgeId h : order) {
    const HalfedgeId o = mesh.opposite(h);
    if (convex_without(domain, kept, h) && convex_without(domain, kept, o))
      kept[at(h)] = kept[at(o)] = false;
  }
  return partition_by(domain, kept);
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
  // The walk goes along a segment and never turns back: no triangle comes twice.
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
      face_(at(uv.rows()), kInvalid),
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

Points2 Carrier::vertices(const std::vector<Vector2>& there) const {
  Points2 result = uv_;
  for (std::size_t v = 0; v < face_.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    if (corner_[v] != kInvalid) result.row(row) = there[at(corner_[v])].transpose();
    if (corner_[v] != kInvalid || face_[v] == kInvalid) continue;
    const auto [i, j, k] = domain_.triangulation.corners(face_[v]);
    const Vector2 &a = here_[at(i)], &b = here_[at(j)], &c = here_[at(k)];
    if (!(twice_area(a, b, c) > 0)) continue;
    const Vector3 w = barycentric(a, b, c, uv_.row(row));
    result.row(row) = (w[0] * there[at(i)] + w[1] * there[at(j)] + w[2] * there[at(k)]).transpose();
  }
  return result;
}

}  // namespace flipfree::matchmaker
