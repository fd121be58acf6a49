#include "flipfree/conformal/map_cut.h"

#include <algorithm>
#include <numeric>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/topology.h"

namespace flipfree {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

EdgeFlags cut_to_disks(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& given,
                       const std::vector<VertexId>& cones, const EdgeFlags& avoided,
                       const ExecutionContext& context) {
  const Triangles& faces = surface.faces;
  const auto halfedge_count = static_cast<HalfedgeId>(adjacency.opposite.size());
  EdgeFlags cut = given.empty() ? EdgeFlags(at(halfedge_count), 0) : given;

  std::vector<double> length(at(halfedge_count));
  for (HalfedgeId h = 0; h < halfedge_count; ++h) {
    length[at(h)] =
        (surface.vertices.row(source(faces, h)) - surface.vertices.row(target(faces, h))).norm();
  }
  if (!avoided.empty()) {
    // Longer than any path along other edges.
    const double detour = std::accumulate(length.begin(), length.end(), 0.0);
    for (HalfedgeId h = 0; h < halfedge_count; ++h) {
      if (avoided[at(h)]) length[at(h)] += detour;
    }
  }
  ShortestPaths forest(faces, adjacency, length);
  std::vector<char> open(adjacency.vertex_halfedge.size(), 0);  // on the boundary or on the cut
  for (HalfedgeId h = 0; h < halfedge_count; ++h) {
    if (adjacency.opposite[at(h)] == kInvalid || cut[at(h)]) {
      open[at(source(faces, h))] = open[at(target(faces, h))] = 1;
    }
  }
  // Every component needs a source: its open vertices, else its first cone, else its first vertex.
  const Components components = face_components(adjacency);
  {
    std::vector<VertexId> chosen(at(components.count), kInvalid);
    std::vector<char> has_open(at(components.count), 0);
    std::vector<Index> component_of(open.size(), kInvalid);
    for (HalfedgeId h = 0; h < halfedge_count; ++h) {
      const VertexId v = source(faces, h);
      component_of[at(v)] = components.of_face[at(h / 3)];
      if (open[at(v)]) has_open[at(component_of[at(v)])] = 1;
    }
    for (const VertexId v : cones) {
      if (component_of[at(v)] != kInvalid && chosen[at(component_of[at(v)])] == kInvalid) {
        chosen[at(component_of[at(v)])] = v;
      }
    }
    for (VertexId v = 0; v < static_cast<VertexId>(open.size()); ++v) {
      if (open[at(v)]) forest.add_source(v);
      const Index c = component_of[at(v)];
      if (c != kInvalid && chosen[at(c)] == kInvalid) chosen[at(c)] = v;
    }
    for (Index c = 0; c < components.count; ++c) {
      if (!has_open[at(c)]) forest.add_source(chosen[at(c)]);
    }
  }
  forest.grow(context);

  const auto mark = [&](HalfedgeId h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || cut[at(h)]) return false;
    cut[at(h)] = cut[at(o)] = 1;
    return true;
  };
  const auto mark_path = [&](VertexId v) {
    while (forest.arrival(v) != kInvalid) {
      if (!mark(forest.arrival(v))) break;  // the rest is cut already
      v = forest.before(v);
    }
  };

  // Cotree: Kruskal over the uncut edges outside the forest, longest closing path first.
  struct DualEdge {
    double weight;
    HalfedgeId halfedge;
  };
  std::vector<DualEdge> dual;
  for (HalfedgeId h = 0; h < halfedge_count; ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || o < h || cut[at(h)]) continue;
    const VertexId a = source(faces, h), b = target(faces, h);
    const HalfedgeId to_a = forest.arrival(a), to_b = forest.arrival(b);
    if (to_a == h || to_a == o || to_b == h || to_b == o) continue;
    dual.push_back({forest.distance(a) + length[at(h)] + forest.distance(b), h});
  }
  context.check();
  std::sort(dual.begin(), dual.end(), [](const DualEdge& a, const DualEdge& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.halfedge < b.halfedge;
  });
  DisjointSets regions(static_cast<Index>(faces.rows()));
  std::vector<HalfedgeId> closing;
  for (const DualEdge& e : dual) {
    if (!regions.join(e.halfedge / 3, adjacency.opposite[at(e.halfedge)] / 3)) {
      closing.push_back(e.halfedge);
    }
  }
  for (const HalfedgeId h : closing) {
    mark(h);
    mark_path(source(faces, h));
    mark_path(target(faces, h));
  }
  // The cones by the shortest way to what is cut by now.
  for (HalfedgeId h = 0; h < halfedge_count; ++h) {
    if (!cut[at(h)]) continue;
    for (const VertexId v : {source(faces, h), target(faces, h)}) {
      if (forest.distance(v) > 0.0) forest.add_source(v);
    }
  }
  forest.grow(context);
  for (const VertexId v : cones) {
    if (adjacency.vertex_halfedge[at(v)] == kInvalid) continue;
    mark_path(v);
  }
  return cut;
}

}  // namespace flipfree
