#include "flipfree/conformal/map_cut.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "flipfree/mesh/topology.h"

namespace flipfree {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// Shortest paths from a set of sources that may grow.
class PathForest {
 public:
  PathForest(const Surface& surface, const Adjacency& adjacency)
      : surface_(surface),
        adjacency_(adjacency),
        length_(adjacency.opposite.size()),
        distance(adjacency.vertex_halfedge.size(), std::numeric_limits<double>::infinity()),
        arrival(adjacency.vertex_halfedge.size(), kInvalid) {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length_.size()); ++h) {
      length_[at(h)] = (surface.vertices.row(source(surface.faces, h)) -
                        surface.vertices.row(target(surface.faces, h)))
                           .norm();
    }
  }

  void add_source(VertexId v) {
    distance[at(v)] = 0.0;
    arrival[at(v)] = kInvalid;
    queue_.emplace(0.0, v);
  }

  // Relaxes until all distances are right.
  void run(const ExecutionContext& context) {
    std::size_t steps = 0;
    while (!queue_.empty()) {
      const auto [d, v] = queue_.top();
      queue_.pop();
      if (d > distance[at(v)]) continue;
      if ((++steps & 0xfff) == 0) context.check();
      const HalfedgeId start = adjacency_.vertex_halfedge[at(v)];
      HalfedgeId h = start;
      do {
        relax(d, v, target(surface_.faces, h), h);
        const HalfedgeId p = previous_corner(h);
        // The last edge of a boundary fan is no outgoing half-edge.
        if (adjacency_.opposite[at(p)] == kInvalid) relax(d, v, source(surface_.faces, p), p);
        h = rotate_ccw(adjacency_, h);
      } while (h != kInvalid && h != start);
    }
  }

  double length(HalfedgeId h) const { return length_[at(h)]; }

 private:
  const Surface& surface_;
  const Adjacency& adjacency_;
  std::vector<double> length_;
  using Entry = std::pair<double, VertexId>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;

  void relax(double d, VertexId, VertexId w, HalfedgeId h) {
    const double through = d + length_[at(h)];
    if (through < distance[at(w)]) {
      distance[at(w)] = through;
      arrival[at(w)] = h;
      queue_.emplace(through, w);
    }
  }

 public:
  std::vector<double> distance;
  std::vector<HalfedgeId>
      arrival;  // the half-edge, in either direction, along which the path arrives
};

Index find_root(std::vector<Index>& parent, Index i) {
  while (parent[at(i)] != i) {
    parent[at(i)] = parent[at(parent[at(i)])];
    i = parent[at(i)];
  }
  return i;
}

}  // namespace

EdgeFlags cut_to_disks(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& given,
                       const std::vector<VertexId>& cones, const ExecutionContext& context) {
  const Triangles& faces = surface.faces;
  const auto halfedge_count = static_cast<HalfedgeId>(adjacency.opposite.size());
  EdgeFlags cut = given.empty() ? EdgeFlags(at(halfedge_count), 0) : given;

  PathForest forest(surface, adjacency);
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
  forest.run(context);

  const auto mark = [&](HalfedgeId h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || cut[at(h)]) return false;
    cut[at(h)] = cut[at(o)] = 1;
    return true;
  };
  const auto mark_path = [&](VertexId v) {
    while (forest.arrival[at(v)] != kInvalid) {
      const HalfedgeId h = forest.arrival[at(v)];
      if (!mark(h)) break;  // the rest is cut already
      v = source(faces, h) == v ? target(faces, h) : source(faces, h);
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
    const HalfedgeId to_a = forest.arrival[at(a)], to_b = forest.arrival[at(b)];
    if (to_a == h || to_a == o || to_b == h || to_b == o) continue;
    dual.push_back({forest.distance[at(a)] + forest.length(h) + forest.distance[at(b)], h});
  }
  context.check();
  std::sort(dual.begin(), dual.end(), [](const DualEdge& a, const DualEdge& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.halfedge < b.halfedge;
  });
  std::vector<Index> parent(at(static_cast<Index>(faces.rows())));
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<HalfedgeId> closing;
  for (const DualEdge& e : dual) {
    const Index a = find_root(parent, e.halfedge / 3);
    const Index b = find_root(parent, adjacency.opposite[at(e.halfedge)] / 3);
    if (a == b) {
      closing.push_back(e.halfedge);
    } else {
      parent[at(a)] = b;
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
      if (forest.distance[at(v)] > 0.0) forest.add_source(v);
    }
  }
  forest.run(context);
  for (const VertexId v : cones) {
    if (adjacency.vertex_halfedge[at(v)] == kInvalid) continue;
    mark_path(v);
  }
  return cut;
}

}  // namespace flipfree
