#include "flipfree/mesh/adjacency.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"

namespace flipfree::mesh {

Adjacency build_adjacency(Index vertex_count, const Triangles& faces) {
  const auto halfedges = static_cast<Index>(3 * faces.rows());
  Adjacency adjacency;
  adjacency.opposite.assign(static_cast<std::size_t>(halfedges), kInvalid);
  adjacency.vertex_halfedge.assign(at(vertex_count), kInvalid);

  // By the smaller end point; a list is a vertex' degree long. Partner through a scratch table
  // indexed by the other end point: linear even where one vertex has huge degree.
  const auto low = [&](HalfedgeId h) { return std::min(source(faces, h), target(faces, h)); };
  const auto high = [&](HalfedgeId h) { return at(std::max(source(faces, h), target(faces, h))); };
  const Lists<HalfedgeId> by_lower_end(at(vertex_count), [&](const auto& add) {
    for (HalfedgeId h = 0; h < halfedges; ++h) add(low(h), h);
  });
  std::vector<HalfedgeId> partner(at(vertex_count), kInvalid);
  for (VertexId v = 0; v < vertex_count; ++v) {
    for (const HalfedgeId h : by_lower_end[v]) {
      HalfedgeId& slot = partner[high(h)];
      if (slot == kInvalid) {
        slot = h;
      } else {
        adjacency.opposite[at(h)] = slot;
        adjacency.opposite[at(slot)] = h;
      }
    }
    for (const HalfedgeId h : by_lower_end[v]) partner[high(h)] = kInvalid;
  }

  for (HalfedgeId h = 0; h < halfedges; ++h) {
    HalfedgeId& slot = adjacency.vertex_halfedge[at(source(faces, h))];
    // A boundary half-edge has no clockwise neighbour, so rotating counter-clockwise from it sees
    // the whole fan.
    if (slot == kInvalid || adjacency.opposite[at(h)] == kInvalid) slot = h;
  }
  return adjacency;
}

const Adjacency& Faces::adjacency(Index vertex_count) const {
  const Adjacency* made = shared_->made.load(std::memory_order_acquire);
  if (made == nullptr) {
    const std::lock_guard lock(shared_->mutex);
    std::unique_ptr<const Adjacency>& own = shared_->adjacency;
    if (own == nullptr)
      own = std::make_unique<const Adjacency>(build_adjacency(vertex_count, shared_->triangles));
    made = own.get();
    shared_->made.store(made, std::memory_order_release);
  }
  if (std::ssize(made->vertex_halfedge) != vertex_count)
    throw InternalError("surface: its faces were asked for with another number of vertices");
  return *made;
}

std::array<Vector3, 3> Surface::corners(FaceId f) const {
  return {vertices.row(faces(f, 0)), vertices.row(faces(f, 1)), vertices.row(faces(f, 2))};
}

Vector3 Surface::area_vector(FaceId f) const {
  const auto [a, b, c] = corners(f);
  return (b - a).cross(c - a);
}

std::vector<std::vector<HalfedgeId>> boundary_halfedge_loops(const Triangles& faces,
                                                             const Adjacency& adjacency) {
  const auto is_boundary = [&](HalfedgeId h) { return adjacency.opposite[at(h)] == kInvalid; };
  std::vector<std::vector<HalfedgeId>> loops;
  std::vector<char> seen(adjacency.opposite.size(), 0);
  const auto vertex_count = static_cast<VertexId>(adjacency.vertex_halfedge.size());
  for (VertexId v = 0; v < vertex_count; ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[at(v)];
    if (start == kInvalid || !is_boundary(start) || seen[at(start)]) continue;
    std::vector<HalfedgeId>& loop = loops.emplace_back();
    HalfedgeId h = start;
    do {
      seen[at(h)] = 1;
      loop.push_back(h);
      h = adjacency.vertex_halfedge[at(target(faces, h))];
    } while (h != start);
  }
  return loops;
}

std::vector<std::vector<VertexId>> boundary_loops(const Triangles& faces,
                                                  const Adjacency& adjacency) {
  std::vector<std::vector<VertexId>> loops;
  for (const std::vector<HalfedgeId>& halfedges : boundary_halfedge_loops(faces, adjacency)) {
    std::vector<VertexId>& loop = loops.emplace_back();
    loop.reserve(halfedges.size());
    for (const HalfedgeId h : halfedges) loop.push_back(source(faces, h));
  }
  return loops;
}

Components components_between(const Adjacency& adjacency, const std::vector<char>& cut) {
  DisjointSets joined(static_cast<Index>(adjacency.opposite.size() / 3));
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o > h && (cut.empty() || cut[at(h)] == 0)) joined.join(h / 3, o / 3);
  }
  Components components{0, joined.firsts()};
  std::vector<Index>& number = components.of_face;
  for (std::size_t f = 0; f < number.size(); ++f)
    number[f] = at(number[f]) == f ? components.count++ : number[at(number[f])];
  return components;
}

Topology topology(const Triangles& faces, const Adjacency& adjacency) {
  Topology t;
  t.faces = static_cast<Index>(faces.rows());
  t.vertices = static_cast<Index>(std::count_if(adjacency.vertex_halfedge.begin(),
                                                adjacency.vertex_halfedge.end(),
                                                [](HalfedgeId h) { return h != kInvalid; }));
  const auto boundary = static_cast<Index>(
      std::count(adjacency.opposite.begin(), adjacency.opposite.end(), kInvalid));
  t.edges = (3 * t.faces + boundary) / 2;
  t.boundary_loops = static_cast<Index>(boundary_halfedge_loops(faces, adjacency).size());
  t.components = face_components(adjacency).count;
  return t;
}

}  // namespace flipfree::mesh
