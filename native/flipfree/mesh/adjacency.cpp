#include "flipfree/mesh/adjacency.h"

#include <algorithm>

namespace flipfree::mesh {

Adjacency build_adjacency(Index vertex_count, const Triangles& faces) {
  const auto halfedges = static_cast<Index>(3 * faces.rows());
  Adjacency adjacency;
  adjacency.opposite.assign(static_cast<std::size_t>(halfedges), kInvalid);
  adjacency.vertex_halfedge.assign(static_cast<std::size_t>(vertex_count), kInvalid);

  // Buckets of half-edges by the smaller end point (counting sort); a bucket is a vertex' degree
  // long.
  std::vector<Index> begin(static_cast<std::size_t>(vertex_count) + 1, 0);
  const auto lower = [&](HalfedgeId h) { return std::min(source(faces, h), target(faces, h)); };
  for (HalfedgeId h = 0; h < halfedges; ++h) ++begin[at(lower(h)) + 1];
  for (std::size_t v = 0; v < static_cast<std::size_t>(vertex_count); ++v) begin[v + 1] += begin[v];
  std::vector<HalfedgeId> bucket(static_cast<std::size_t>(halfedges));
  std::vector<Index> fill(begin.begin(), begin.end() - 1);
  for (HalfedgeId h = 0; h < halfedges; ++h) {
    bucket[at(fill[at(lower(h))]++)] = h;
  }
  // Partner through a scratch table indexed by the other end point: linear even where one vertex
  // has huge degree.
  std::vector<HalfedgeId> partner(static_cast<std::size_t>(vertex_count), kInvalid);
  for (VertexId v = 0; v < vertex_count; ++v) {
    const auto first = static_cast<std::size_t>(begin[at(v)]);
    const auto last = static_cast<std::size_t>(begin[at(v) + 1]);
    const auto other = [&](HalfedgeId h) {
      return static_cast<std::size_t>(std::max(source(faces, h), target(faces, h)));
    };
    for (std::size_t i = first; i < last; ++i) {
      const HalfedgeId h = bucket[i];
      HalfedgeId& slot = partner[other(h)];
      if (slot == kInvalid) {
        slot = h;
      } else {
        adjacency.opposite[at(h)] = slot;
        adjacency.opposite[at(slot)] = h;
      }
    }
    for (std::size_t i = first; i < last; ++i) partner[other(bucket[i])] = kInvalid;
  }

  for (HalfedgeId h = 0; h < halfedges; ++h) {
    HalfedgeId& slot = adjacency.vertex_halfedge[at(source(faces, h))];
    // A boundary half-edge has no clockwise neighbour, so rotating counter-clockwise from it sees
    // the whole fan.
    if (slot == kInvalid || adjacency.opposite[at(h)] == kInvalid) slot = h;
  }
  return adjacency;
}

}  // namespace flipfree::mesh
