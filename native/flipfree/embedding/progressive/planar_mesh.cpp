#include "flipfree/embedding/progressive/planar_mesh.h"

#include "flipfree/mesh/adjacency.h"

namespace flipfree::embedding {

using Size = std::size_t;

PlanarMesh::PlanarMesh(const Triangles& faces, Index vertex_count,
                       const std::vector<VertexId>& loop)
    : vertex_(faces.data(), faces.data() + faces.size()),
      degree_(static_cast<Size>(vertex_count), 0),
      boundary_(static_cast<Size>(vertex_count), 0),
      alive_(static_cast<Size>(faces.rows()), 1) {
  mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  opposite_ = std::move(adjacency.opposite);
  outgoing_ = std::move(adjacency.vertex_halfedge);
  for (const VertexId v : loop) boundary_[static_cast<Size>(v)] = 1;
  for (const VertexId v : vertex_) ++degree_[static_cast<Size>(v)];
  for (const VertexId v : loop)
    ++degree_[static_cast<Size>(v)];  // a boundary fan has one edge more than faces
}

bool PlanarMesh::adjacent(VertexId v, VertexId w) const {
  if (degree(w) < degree(v)) std::swap(v, w);
  const HalfedgeId first = outgoing(v);
  HalfedgeId h = first;
  do {
    if (target(h) == w || apex(h) == w) return true;
    h = rotate(h);
  } while (h != kInvalid && h != first);
  return false;
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

void PlanarMesh::collapse(HalfedgeId h) {
  const HalfedgeId g = opposite(h);
  const VertexId m = source(h);
  const VertexId v0 = target(h);
  const VertexId a = apex(h);
  const VertexId b = apex(g);
  const HalfedgeId x = opposite(next_corner(h));      // a -> v0
  const HalfedgeId y = opposite(previous_corner(h));  // m -> a
  const HalfedgeId z = opposite(next_corner(g));      // b -> m
  const HalfedgeId w = opposite(previous_corner(g));  // v0 -> b
  for (HalfedgeId c = y;; c = rotate(c)) {
    vertex_[static_cast<Size>(c)] = v0;
    if (previous_corner(c) == z) break;
  }
  opposite_[static_cast<Size>(x)] = y;
  opposite_[static_cast<Size>(y)] = x;
  opposite_[static_cast<Size>(z)] = w;
  opposite_[static_cast<Size>(w)] = z;
  alive_[static_cast<Size>(h / 3)] = 0;
  alive_[static_cast<Size>(g / 3)] = 0;
  outgoing_[static_cast<Size>(v0)] = y;
  if (!is_boundary(a)) outgoing_[static_cast<Size>(a)] = x;
  if (!is_boundary(b)) outgoing_[static_cast<Size>(b)] = z;
  degree_[static_cast<Size>(v0)] += degree(m) - 4;
  --degree_[static_cast<Size>(a)];
  --degree_[static_cast<Size>(b)];
}

void PlanarMesh::split(HalfedgeId h) {
  const HalfedgeId g = opposite(h);
  const VertexId m = source(h);
  const VertexId v0 = target(h);
  const VertexId a = apex(h);
  const VertexId b = apex(g);
  const HalfedgeId x = opposite(next_corner(h));
  const HalfedgeId y = opposite(previous_corner(h));
  const HalfedgeId z = opposite(next_corner(g));
  const HalfedgeId w = opposite(previous_corner(g));
  for (HalfedgeId c = y;; c = rotate(c)) {
    vertex_[static_cast<Size>(c)] = m;
    if (previous_corner(c) == z) break;
  }
  opposite_[static_cast<Size>(x)] = next_corner(h);
  opposite_[static_cast<Size>(y)] = previous_corner(h);
  opposite_[static_cast<Size>(z)] = next_corner(g);
  opposite_[static_cast<Size>(w)] = previous_corner(g);
  alive_[static_cast<Size>(h / 3)] = 1;
  alive_[static_cast<Size>(g / 3)] = 1;
  outgoing_[static_cast<Size>(m)] = h;
  outgoing_[static_cast<Size>(v0)] = g;
  degree_[static_cast<Size>(v0)] -= degree(m) - 4;
  ++degree_[static_cast<Size>(a)];
  ++degree_[static_cast<Size>(b)];
}

}  // namespace flipfree::embedding
