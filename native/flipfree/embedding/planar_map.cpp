#include "flipfree/embedding/planar_map.h"

#include <utility>

#include "flipfree/mesh/adjacency.h"

namespace flipfree::embedding {

PlanarMesh::PlanarMesh(const Triangles& faces, Index vertex_count,
                       const std::vector<VertexId>& loop)
    : vertex_(faces.data(), faces.data() + faces.size()),
      degree_(at(vertex_count), 0),
      boundary_(at(vertex_count), 0),
      alive_(at(faces.rows()), 1) {
  mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  opposite_ = std::move(adjacency.opposite);
  outgoing_ = std::move(adjacency.vertex_halfedge);
  for (const VertexId v : loop) boundary_[at(v)] = 1;
  for (const VertexId v : vertex_) ++degree_[at(v)];
  for (const VertexId v : loop) ++degree_[at(v)];  // a boundary fan has one edge more than faces
}

bool PlanarMesh::adjacent(VertexId v, VertexId w) const {
  if (degree(w) < degree(v)) std::swap(v, w);
  bool found = false;
  for_each_outgoing(outgoing(v),
                    [&](HalfedgeId h) { found = found || target(h) == w || apex(h) == w; });
  return found;
}

bool PlanarMesh::can_collapse(HalfedgeId h) const {
  const VertexId m = source(h);
  const VertexId v0 = target(h);
  if (is_boundary(m) || is_boundary(v0)) return false;
  const VertexId a = apex(h);
  const VertexId b = apex(opposite(h));
  for (HalfedgeId g = rotate(h); g != h; g = rotate(g)) {
    const VertexId x = target(g);
    if (x != a && x != b && adjacent(x, v0)) return false;
  }
  return true;
}

PlanarMesh::Diamond PlanarMesh::diamond(HalfedgeId h) const {
  const HalfedgeId g = opposite(h);
  return {g,
          source(h),
          target(h),
          apex(h),
          apex(g),
          opposite(next_corner(h)),
          opposite(previous_corner(h)),
          opposite(next_corner(g)),
          opposite(previous_corner(g))};
}

void PlanarMesh::give_fan(const Diamond& d, VertexId v) {
  for (HalfedgeId c = d.y;; c = rotate(c)) {
    vertex_[at(c)] = v;
    if (previous_corner(c) == d.z) break;
  }
}

void PlanarMesh::link(HalfedgeId h, HalfedgeId g) {
  opposite_[at(h)] = g;
  opposite_[at(g)] = h;
}

void PlanarMesh::collapse(HalfedgeId h) {
  const Diamond d = diamond(h);
  give_fan(d, d.v0);
  link(d.x, d.y);
  link(d.z, d.w);
  alive_[at(h / 3)] = alive_[at(d.g / 3)] = 0;
  outgoing_[at(d.v0)] = d.y;
  if (!is_boundary(d.a)) outgoing_[at(d.a)] = d.x;
  if (!is_boundary(d.b)) outgoing_[at(d.b)] = d.z;
  degree_[at(d.v0)] += degree(d.m) - 4;
  --degree_[at(d.a)];
  --degree_[at(d.b)];
}

void PlanarMesh::split(HalfedgeId h) {
  const Diamond d = diamond(h);
  give_fan(d, d.m);
  link(d.x, next_corner(h));
  link(d.y, previous_corner(h));
  link(d.z, next_corner(d.g));
  link(d.w, previous_corner(d.g));
  alive_[at(h / 3)] = alive_[at(d.g / 3)] = 1;
  outgoing_[at(d.m)] = h;
  outgoing_[at(d.v0)] = d.g;
  degree_[at(d.v0)] -= degree(d.m) - 4;
  ++degree_[at(d.a)];
  ++degree_[at(d.b)];
}

PlanarMap make_planar_map(const Triangles& faces, const std::vector<VertexId>& loop,
                          const Points2& uv, bool float32) {
  const auto n = static_cast<Index>(uv.rows());
  PlanarMap map{PlanarMesh(faces, n, loop), uv, {}, float32, {}};
  map.share.assign(at(faces.rows()), 1.0);
  map.invalid_energy = float32 ? kInvalidEnergyFloat : kInvalidEnergyDouble;
  double twice = 0.0;  // the polygon's area
  for (std::size_t i = 1; i + 1 < loop.size(); ++i)
    twice += twice_area(map.at(loop[0]), map.at(loop[i]), map.at(loop[i + 1]));
  map.unit = std::abs(twice / 2) / static_cast<double>(faces.rows());
  if (float32) {
    const Points2 rounded = as_stored(uv);
    for (VertexId v = 0; v < n; ++v) {
      if (!map.mesh.is_boundary(v)) map.uv.row(v) = rounded.row(v);
    }
    if (rounded != map.uv) map.stored = rounded;
  }
  return map;
}

}  // namespace flipfree::embedding
