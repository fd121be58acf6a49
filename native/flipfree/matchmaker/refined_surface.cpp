#include "flipfree/matchmaker/refined_surface.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {

double Support::of(VertexId v) const {
  for (std::size_t i = 0; i < 3; ++i) {
    if (vertex[i] == v && v != kInvalid) return weight[i];
  }
  return 0.0;
}

Support midpoint(const Support& a, const Support& b) {
  std::array<VertexId, 6> all = {a.vertex[0], a.vertex[1], a.vertex[2],
                                 b.vertex[0], b.vertex[1], b.vertex[2]};
  std::sort(all.begin(), all.end());
  Support result;
  std::size_t count = 0;
  for (const VertexId v : all) {
    if (v == kInvalid || (count > 0 && result.vertex[count - 1] == v)) continue;
    if (count == 3) throw InternalError("midpoint of points that share no input face");
    result.vertex[count] = v;
    result.weight[count++] = 0.5 * (a.of(v) + b.of(v));
  }
  return result;
}

VertexId RefinedSurface::split_edge(HalfedgeId h) {
  const auto a = static_cast<std::size_t>(mesh.source(h));
  const auto b = static_cast<std::size_t>(mesh.target(h));
  const VertexId s = mesh.split_edge(h);
  const bool on_input = !support[a].empty() && !support[b].empty();
  support.push_back(on_input ? midpoint(support[a], support[b]) : Support{});
  Vector3 where = 0.5 * (position[a] + position[b]);
  if (on_input) {
    where.setZero();
    for (std::size_t i = 0; i < 3 && support.back().vertex[i] != kInvalid; ++i) {
      where += support.back().weight[i] * input->vertices.row(support.back().vertex[i]).transpose();
    }
  }
  position.push_back(where);
  return s;
}

int RefinedSurface::orientation_in_parent(FaceId parent, VertexId a, VertexId b, VertexId c) const {
  const auto planar = [&](VertexId v) {
    const Support& s = support[static_cast<std::size_t>(v)];
    return Vector2(s.of(input->faces(parent, 1)), s.of(input->faces(parent, 2)));
  };
  return orientation(planar(a), planar(b), planar(c));
}

RefinedSurface make_refined_surface(const Surface& surface, bool with_collar) {
  RefinedSurface refined;
  refined.input = &surface;
  const auto n = static_cast<Index>(surface.vertices.rows());
  const auto m = static_cast<Index>(surface.faces.rows());
  refined.boundary = boundary_loops(surface.faces, build_adjacency(n, surface.faces)).front();
  refined.outer_boundary = refined.boundary;
  Triangles faces = surface.faces;
  const auto loop = static_cast<Index>(refined.boundary.size());
  refined.support.resize(static_cast<std::size_t>(n));
  refined.position.resize(static_cast<std::size_t>(n));
  for (Index v = 0; v < n; ++v) {
    refined.support[static_cast<std::size_t>(v)] = {{v, kInvalid, kInvalid}, {1.0, 0.0, 0.0}};
    refined.position[static_cast<std::size_t>(v)] = surface.vertices.row(v).transpose();
  }
  if (with_collar) {
    //  n+i ---- n+i+1     the collar lies to the right of the loop b_i -> b_i+1
    //   | \       |
    //  b_i --- b_i+1
    faces.conservativeResize(m + 2 * loop, 3);
    Vector3 centre = Vector3::Zero();
    for (const VertexId v : refined.boundary) centre += surface.vertices.row(v).transpose();
    centre /= static_cast<double>(loop);
    for (Index i = 0; i < loop; ++i) {
      const VertexId b0 = refined.boundary[static_cast<std::size_t>(i)];
      const VertexId b1 = refined.boundary[static_cast<std::size_t>((i + 1) % loop)];
      const VertexId c0 = n + i;
      const VertexId c1 = n + (i + 1) % loop;
      faces.row(m + 2 * i) << b1, b0, c0;
      faces.row(m + 2 * i + 1) << b1, c0, c1;
      refined.outer_boundary[static_cast<std::size_t>(i)] = c0;
      refined.support.emplace_back();
      const Vector3 p = surface.vertices.row(b0).transpose();
      refined.position.emplace_back(p + 0.2 * (p - centre));
    }
  }
  const auto vertex_count = static_cast<Index>(refined.support.size());
  refined.mesh = EditableTriangulation(vertex_count, faces);
  for (FaceId f = m; f < refined.mesh.face_slots(); ++f) refined.mesh.set_parent(f, kInvalid);
  return refined;
}

}  // namespace flipfree
