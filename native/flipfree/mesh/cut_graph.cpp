#include "flipfree/mesh/cut_graph.h"

#include <algorithm>
#include <string>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/fill.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/topology.h"

namespace flipfree {
namespace {

[[noreturn]] void refuse_uncuttable(VertexId v) {
  throw_invalid(ErrorCode::kBadOption,
                "The uncuttable edges leave no way to cut the surface open at vertex " +
                    std::to_string(v) + ". Leave some of them out.",
                ElementKind::kVertex, {v});
}

}  // namespace

EdgeFlags planar_cut(const Surface& surface, const Adjacency& adjacency,
                     const ExecutionContext& context, const EdgeFlags& uncuttable) {
  EdgeFlags cut(adjacency.opposite.size(), 0);
  const Topology shape = topology(surface.faces, adjacency);
  const bool closed = shape.boundary_loops == 0;
  if (!closed && shape.genus() == 0) return cut;

  // On the surface with its holes filled by fans, whose edges cost nothing: a loop may end in a
  // hole.
  const FilledSurface filled =
      fill_holes(surface, boundary_halfedge_loops(surface.faces, adjacency));
  const auto vertex_count = static_cast<Index>(filled.surface.vertices.rows());
  const Adjacency full = build_adjacency(vertex_count, filled.surface.faces);
  const Triangles& faces = filled.surface.faces;
  const auto real_vertices = static_cast<Index>(surface.vertices.rows());
  std::vector<double> length(full.opposite.size());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length.size()); ++h) {
    const VertexId a = source(faces, h);
    const VertexId b = target(faces, h);
    const bool real = a < real_vertices && b < real_vertices;
    length[static_cast<std::size_t>(h)] =
        real ? (filled.surface.vertices.row(a) - filled.surface.vertices.row(b)).norm() : 0.0;
  }
  // Infinitely long, such an edge lies on no shortest path, and the cotree takes it first.
  for (std::size_t h = 0; h < uncuttable.size(); ++h) {
    if (uncuttable[h]) length[h] = ShortestPaths::kUnreached;
  }

  const auto mark = [&](HalfedgeId h) {
    if (length[static_cast<std::size_t>(h)] == ShortestPaths::kUnreached) {
      refuse_uncuttable(source(faces, h));
    }
    const HalfedgeId o = full.opposite[static_cast<std::size_t>(h)];
    // Fan edges are not edges of the surface, and the rim of a hole is open already.
    if (h >= static_cast<HalfedgeId>(cut.size()) || o >= static_cast<HalfedgeId>(cut.size()))
      return;
    cut[static_cast<std::size_t>(h)] = cut[static_cast<std::size_t>(o)] = 1;
  };
  const auto mark_path = [&](const ShortestPaths& paths, VertexId v) {
    while (paths.arrival(v) != kInvalid) {
      mark(paths.arrival(v));
      v = paths.before(v);
    }
  };
  const auto farthest = [&](const ShortestPaths& paths) {
    VertexId best = 0;
    double distance = -1.0;
    for (VertexId v = 0; v < real_vertices; ++v) {
      const double d = paths.distance(v);
      if (d > distance && d < ShortestPaths::kUnreached) {
        best = v;
        distance = d;
      }
    }
    return best;
  };

  const auto paths_from = [&](VertexId v) {
    ShortestPaths paths(faces, full, length);
    paths.add_source(v);
    paths.grow(context);
    for (VertexId w = 0; w < real_vertices; ++w) {
      const bool used = adjacency.vertex_halfedge[static_cast<std::size_t>(w)] != kInvalid;
      if (used && paths.distance(w) == ShortestPaths::kUnreached) refuse_uncuttable(w);
    }
    return paths;
  };
  VertexId root = source(faces, 0);
  if (shape.genus() == 0) {
    // Twice to the farthest vertex: the ends of a long shortest path, about a diameter.
    root = farthest(paths_from(root));
    const ShortestPaths paths = paths_from(root);
    const VertexId end = farthest(paths);
    mark_path(paths, end);
    if (paths.arrival(end) != kInvalid && paths.before(end) == root) {
      // A single edge opens nothing: go on by one more.
      const HalfedgeId last = full.opposite[static_cast<std::size_t>(paths.arrival(end))];
      HalfedgeId next = rotate_ccw(full, last);
      while (length[static_cast<std::size_t>(next)] == ShortestPaths::kUnreached) {
        next = rotate_ccw(full, next);  // `last` itself can be cut: this ends
      }
      if (next == last) refuse_uncuttable(end);
      mark(next);
    }
    return cut;
  }

  const ShortestPaths paths = paths_from(root);
  // Cotree: a maximum spanning tree of the dual, an edge weighing as much as the loop that it would
  // close.
  const auto loop_length = [&](HalfedgeId h) {
    return paths.distance(source(faces, h)) + length[static_cast<std::size_t>(h)] +
           paths.distance(target(faces, h));
  };
  std::vector<HalfedgeId> edges;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(full.opposite.size()); ++h) {
    const HalfedgeId o = full.opposite[static_cast<std::size_t>(h)];
    if (h > o) continue;
    const bool in_tree =
        paths.arrival(target(faces, h)) == h || paths.arrival(source(faces, h)) == o;
    if (!in_tree) edges.push_back(h);
  }
  context.check();
  std::sort(edges.begin(), edges.end(), [&](HalfedgeId a, HalfedgeId b) {
    const double la = loop_length(a);
    const double lb = loop_length(b);
    return la != lb ? la > lb : a < b;
  });
  DisjointSets regions(static_cast<Index>(faces.rows()));
  for (const HalfedgeId h : edges) {
    if (regions.join(h / 3, full.opposite[static_cast<std::size_t>(h)] / 3)) continue;
    mark(h);
    mark_path(paths, source(faces, h));
    mark_path(paths, target(faces, h));
  }
  // Paths from the root that all loops share beyond its last branch dangle: prune leaves until none
  // is left.
  std::vector<Index> degree(static_cast<std::size_t>(vertex_count), 0);
  const auto flagged = [&](HalfedgeId h) {
    return h < static_cast<HalfedgeId>(cut.size()) && cut[static_cast<std::size_t>(h)];
  };
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (flagged(h)) ++degree[static_cast<std::size_t>(source(faces, h))];
  }
  std::vector<VertexId> leaves;
  const auto on_rim = [&](VertexId v) {
    const HalfedgeId start = adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    return adjacency.opposite[static_cast<std::size_t>(start)] == kInvalid;
  };
  for (VertexId v = 0; v < real_vertices; ++v) {
    if (degree[static_cast<std::size_t>(v)] == 1 && !on_rim(v)) leaves.push_back(v);
  }
  while (!leaves.empty()) {
    const VertexId v = leaves.back();
    leaves.pop_back();
    if (degree[static_cast<std::size_t>(v)] != 1) continue;
    HalfedgeId h = adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    while (!flagged(h)) h = rotate_ccw(adjacency, h);
    const VertexId w = target(faces, h);
    cut[static_cast<std::size_t>(h)] =
        cut[static_cast<std::size_t>(adjacency.opposite[static_cast<std::size_t>(h)])] = 0;
    --degree[static_cast<std::size_t>(v)];
    if (--degree[static_cast<std::size_t>(w)] == 1 && !on_rim(w)) leaves.push_back(w);
  }
  return cut;
}

}  // namespace flipfree
