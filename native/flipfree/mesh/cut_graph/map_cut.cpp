#include "flipfree/mesh/cut_graph/map_cut.h"

#include <algorithm>
#include <numeric>

#include "flipfree/base/debug_check.h"
#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/cut_graph/shortest_paths.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::mesh {
namespace {

// Per half-edge; those that shall be avoided are longer than any path along others.
std::vector<double> path_lengths(const Surface& surface, const Adjacency& adjacency,
                                 const EdgeFlags& avoided) {
  std::vector<double> length(at(static_cast<Index>(surface.faces.size())));
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && o < h) {
      length[at(h)] = length[at(o)];
      continue;
    }
    const VertexId a = source(surface.faces, h), b = target(surface.faces, h);
    length[at(h)] = (surface.vertices.row(a) - surface.vertices.row(b)).norm();
  }
  if (avoided.empty()) return length;
  const double detour = std::accumulate(length.begin(), length.end(), 0.0);
  for (std::size_t h = 0; h < length.size(); ++h) {
    if (avoided[h]) length[h] += detour;
  }
  return length;
}

// What every component's forest grows from: its vertices on the boundary or on the cut, else its
// first cone, else its first vertex.
std::vector<VertexId> forest_sources(const Triangles& faces, const Adjacency& adjacency,
                                     const EdgeFlags& cut, const std::vector<VertexId>& cones) {
  const Components components = face_components(adjacency);
  std::vector<char> open(adjacency.vertex_halfedge.size(), 0);
  std::vector<char> has_open(at(components.count), 0);
  std::vector<Index> component_of(open.size(), kInvalid);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    const Index component = components.of_face[at(h / 3)];
    component_of[at(source(faces, h))] = component;
    if (adjacency.opposite[at(h)] != kInvalid && !cut[at(h)]) continue;
    open[at(source(faces, h))] = open[at(target(faces, h))] = 1;
    has_open[at(component)] = 1;
  }
  std::vector<VertexId> chosen(at(components.count), kInvalid);
  const auto choose = [&](VertexId v) {
    const Index component = component_of[at(v)];
    if (component != kInvalid && chosen[at(component)] == kInvalid) chosen[at(component)] = v;
  };
  for (const VertexId v : cones) choose(v);
  std::vector<VertexId> sources;
  for (VertexId v = 0; v < static_cast<VertexId>(open.size()); ++v) {
    if (open[at(v)]) sources.push_back(v);
    choose(v);
  }
  for (Index c = 0; c < components.count; ++c) {
    if (!has_open[at(c)]) sources.push_back(chosen[at(c)]);
  }
  return sources;
}

// The edges that neither the forest nor the cotree holds. Cotree: Kruskal over the uncut edges
// outside the forest, longest closing path first.
std::vector<HalfedgeId> closing_edges(const Triangles& faces, const Adjacency& adjacency,
                                      const EdgeFlags& cut, const ShortestPaths& forest,
                                      const std::vector<double>& length,
                                      const ExecutionContext& context) {
  struct DualEdge {
    double weight;
    HalfedgeId halfedge;
  };
  std::vector<DualEdge> dual;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
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
    if (!regions.join(e.halfedge / 3, adjacency.opposite[at(e.halfedge)] / 3))
      closing.push_back(e.halfedge);
  }
  return closing;
}

}  // namespace

EdgeFlags cut_to_disks(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& given,
                       const std::vector<VertexId>& cones, const EdgeFlags& avoided,
                       const ExecutionContext& context) {
  const Triangles& faces = surface.faces;
  EdgeFlags cut = given.empty() ? EdgeFlags(adjacency.opposite.size(), 0) : given;
  const std::vector<double> length = path_lengths(surface, adjacency, avoided);
  ShortestPaths forest(faces, adjacency, length);
  for (const VertexId v : forest_sources(faces, adjacency, cut, cones)) forest.add_source(v);
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
  for (const HalfedgeId h : closing_edges(faces, adjacency, cut, forest, length, context)) {
    mark(h);
    mark_path(source(faces, h));
    mark_path(target(faces, h));
  }
  // The cones by the shortest way to what is cut by now.
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
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
  debug_check("cut_to_disks", [&] { return find_broken_disks(surface, adjacency, cut, cones); });
  return cut;
}

std::string find_broken_disks(const Surface& surface, const Adjacency& adjacency,
                              const EdgeFlags& cut, const std::vector<VertexId>& cones) {
  const Triangles& faces = surface.faces;
  if (cut.size() != adjacency.opposite.size()) return "not one flag per half-edge";
  std::vector<char> open(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid ? cut[at(h)] != 0 : (cut[at(h)] != 0) != (cut[at(o)] != 0))
      return "flags differ at half-edge " + std::to_string(h);
    if (o != kInvalid && cut[at(h)] == 0) continue;
    open[at(source(faces, h))] = open[at(target(faces, h))] = 1;
  }
  for (const VertexId v : cones) {
    if (adjacency.vertex_halfedge[at(v)] != kInvalid && open[at(v)] == 0)
      return "cone " + std::to_string(v) + " is not on the cut";
  }
  const std::vector<Chart> charts =
      split_into_charts(surface.vertices, cut_along(faces, adjacency, cut));
  for (const Chart& chart : charts) {
    const auto vertices = static_cast<Index>(chart.surface.vertices.rows());
    const Triangles& own = chart.surface.faces;
    if (!topology(own, build_adjacency(vertices, own)).is_disk())
      return "the piece of face " + std::to_string(chart.faces.front()) + " is no disk";
  }
  return {};
}

}  // namespace flipfree::mesh
