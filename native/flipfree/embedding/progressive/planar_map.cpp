#include "flipfree/embedding/progressive/planar_map.h"

#include "flipfree/base/plane.h"
#include "flipfree/embedding/disk/disk.h"
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

namespace {

// Exact area is not needed: twice the signed area of the polygon through the loop, in floating
// point.
double polygon_area(const Points2& p) {
  double twice = 0.0;
  for (Index i = 1; i + 1 < p.rows(); ++i) {
    const Vector2 a = (p.row(i) - p.row(0)).transpose();
    const Vector2 b = (p.row(i + 1) - p.row(0)).transpose();
    twice += cross(a, b);
  }
  return twice / 2;
}

}  // namespace

PlanarMap make_planar_map(const Triangles& faces, const std::vector<VertexId>& loop,
                          const Points2& uv, bool float32) {
  const Index n = static_cast<Index>(uv.rows());
  PlanarMap map{PlanarMesh(faces, n, loop), uv, {}, float32, {}};
  map.share.assign(static_cast<std::size_t>(faces.rows()), 1.0);
  Points2 polygon(static_cast<Index>(loop.size()), 2);
  for (std::size_t i = 0; i < loop.size(); ++i)
    polygon.row(static_cast<Index>(i)) = uv.row(loop[i]);
  map.invalid_energy = float32 ? kInvalidEnergyFloat : kInvalidEnergyDouble;
  map.unit = std::abs(polygon_area(polygon)) / static_cast<double>(faces.rows());
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
