// The constrained Delaunay triangulation behind triangulate_embedded; apart from the rest because
// of CGAL's headers.
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <deque>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/target/target_domain.h"

namespace flipfree::matchmaker {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Index, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<
    Kernel, CGAL::Triangulation_face_base_with_info_2<bool, Kernel>>;
using Cdt = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
    CGAL::No_constraint_intersection_tag>;

// info() of a face becomes true if it lies outside the outline: reachable from infinity without
// crossing it.
void mark_outside(Cdt& cdt, const std::vector<bool>& is_outline_vertex, std::size_t outline_size) {
  const auto on_outline = [&](const Cdt::Edge& e) {
    if (!cdt.is_constrained(e)) return false;
    const auto a = static_cast<std::size_t>(e.first->vertex(Cdt::cw(e.second))->info());
    const auto b = static_cast<std::size_t>(e.first->vertex(Cdt::ccw(e.second))->info());
    if (!is_outline_vertex[a] || !is_outline_vertex[b]) return false;
    return (a + 1) % outline_size == b || (b + 1) % outline_size == a;
  };
  for (const Cdt::Face_handle f : cdt.all_face_handles()) f->info() = false;
  std::deque<Cdt::Face_handle> queue = {cdt.infinite_face()};
  cdt.infinite_face()->info() = true;
  while (!queue.empty()) {
    const Cdt::Face_handle f = queue.front();
    queue.pop_front();
    for (int k = 0; k < 3; ++k) {
      const Cdt::Face_handle g = f->neighbor(k);
      if (g->info()) continue;
      if (!cdt.is_infinite(f) || !cdt.is_infinite(g)) {
        if (on_outline({f, k})) continue;
      }
      g->info() = true;
      queue.push_back(g);
    }
  }
}

}  // namespace

TargetDomain triangulate_embedded(const Polygon& outline, std::span<const Vector2> inner,
                                  std::span<const std::pair<Index, Index>> fixed_edges) {
  TargetDomain domain;
  domain.point.assign(outline.begin(), outline.end());
  domain.point.insert(domain.point.end(), inner.begin(), inner.end());
  domain.mesh_vertex.assign(domain.point.size(), kInvalid);
  Cdt cdt;
  std::vector<Cdt::Vertex_handle> handle;
  std::vector<bool> is_outline(domain.point.size(), false);
  for (std::size_t i = 0; i < domain.point.size(); ++i) {
    handle.push_back(cdt.insert({domain.point[i].x(), domain.point[i].y()}));
    handle.back()->info() = static_cast<Index>(i);
    is_outline[i] = i < outline.size();
  }
  if (cdt.number_of_vertices() != domain.point.size())
    throw InternalError("target points coincide");
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    domain.outline.push_back(static_cast<Index>(i));
    cdt.insert_constraint(handle[i], handle[(i + 1) % n]);
  }
  for (const auto& [a, b] : fixed_edges) {
    cdt.insert_constraint(handle[at(a)], handle[at(b)]);
  }
  mark_outside(cdt, is_outline, n);
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (const Cdt::Face_handle f : cdt.finite_face_handles()) {
    if (f->info()) continue;
    triangles.push_back({f->vertex(0)->info(), f->vertex(1)->info(), f->vertex(2)->info()});
  }
  Triangles faces(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    faces.row(static_cast<Eigen::Index>(t)) << triangles[t][0], triangles[t][1], triangles[t][2];
  }
  domain.triangulation =
      mesh::EditableTriangulation(static_cast<Index>(domain.point.size()), faces);
  const auto fix = [&](Index a, Index b) {
    const HalfedgeId h = domain.triangulation.find(a, b);
    if (h == kInvalid) throw InternalError("a fixed edge is not in the target's triangulation");
    domain.triangulation.set_mark(h, TargetDomain::kFixedEdge);
  };
  for (std::size_t i = 0; i < n; ++i) fix(static_cast<Index>(i), static_cast<Index>((i + 1) % n));
  for (const auto& [a, b] : fixed_edges) fix(a, b);
  return domain;
}

}  // namespace flipfree::matchmaker
