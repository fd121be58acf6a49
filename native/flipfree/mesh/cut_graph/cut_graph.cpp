#include "flipfree/mesh/cut_graph/cut_graph.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/cut_graph/fill.h"
#include "flipfree/mesh/cut_graph/shortest_paths.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::mesh {
namespace {

[[noreturn]] void refuse_uncuttable(VertexId v) {
  throw_invalid(ErrorCode::kBadOption,
                "The uncuttable edges leave no way to cut the surface open at vertex " +
                    std::to_string(v) + ". Leave some of them out.",
                ElementKind::kVertex, {v});
}

// Works on the surface with its holes filled by fans, whose edges cost nothing: a loop may end in a
// hole.
class PlanarCutter {
 public:
  PlanarCutter(const Surface& surface, const Adjacency& adjacency, const ExecutionContext& context,
               const EdgeFlags& uncuttable, const std::vector<char>& avoided,
               const std::vector<double>& cost)
      : adjacency_(adjacency),
        context_(context),
        avoided_(avoided),
        real_vertices_(static_cast<Index>(surface.vertices.rows())),
        filled_(fill_holes(surface, boundary_halfedge_loops(surface.faces, adjacency)).surface),
        full_(build_adjacency(static_cast<Index>(filled_.vertices.rows()), filled_.faces)),
        length_(full_.opposite.size()),
        cut_(adjacency.opposite.size(), 0) {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length_.size()); ++h) {
      const VertexId a = source(filled_.faces, h);
      const VertexId b = target(filled_.faces, h);
      const bool real = a < real_vertices_ && b < real_vertices_;
      length_[static_cast<std::size_t>(h)] =
          real ? (filled_.vertices.row(a) - filled_.vertices.row(b)).norm() : 0.0;
    }
    for (std::size_t h = 0; h < cost.size(); ++h) {
      if (length_[h] > 0.0) length_[h] = cost[h];
    }
    if (!avoided_.empty()) lengthen_at_avoided();
    // Infinitely long, such an edge lies on no shortest path, and the cotree takes it first.
    for (std::size_t h = 0; h < uncuttable.size(); ++h) {
      if (uncuttable[h]) length_[h] = ShortestPaths::kUnreached;
    }
  }

  // Twice to the farthest vertex: the ends of a long shortest path, about a diameter.
  EdgeFlags open_sphere() {
    const VertexId root = farthest(paths_from(any_root()));
    const ShortestPaths paths = paths_from(root);
    VertexId end = farthest(paths);
    // Lengths may vanish among doubles: then any neighbour is as far as any other vertex.
    if (end == root) end = neighbour(root, paths);
    mark_path(paths, end);
    if (paths.arrival(end) != kInvalid && paths.before(end) == root) {
      // A single edge opens nothing: go on by one more.
      const HalfedgeId last = full_.opposite[static_cast<std::size_t>(paths.arrival(end))];
      HalfedgeId next = rotate_ccw(full_, last);
      while (length_[static_cast<std::size_t>(next)] == ShortestPaths::kUnreached) {
        next = rotate_ccw(full_, next);  // `last` itself can be cut: this ends
      }
      if (next == last) refuse_uncuttable(end);
      mark(next);
    }
    return std::move(cut_);
  }

  // Tree and cotree; the cotree is a maximum spanning tree of the dual, an edge weighing as much as
  // the loop that it would close.
  EdgeFlags open_handles() {
    const Triangles& faces = filled_.faces;
    const ShortestPaths paths = paths_from(any_root());
    const auto loop_length = [&](HalfedgeId h) {
      return paths.distance(source(faces, h)) + length_[static_cast<std::size_t>(h)] +
             paths.distance(target(faces, h));
    };
    std::vector<HalfedgeId> edges;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(full_.opposite.size()); ++h) {
      const HalfedgeId o = full_.opposite[static_cast<std::size_t>(h)];
      if (h > o) continue;
      const bool in_tree =
          paths.arrival(target(faces, h)) == h || paths.arrival(source(faces, h)) == o;
      if (!in_tree) edges.push_back(h);
    }
    context_.check();
    std::sort(edges.begin(), edges.end(), [&](HalfedgeId a, HalfedgeId b) {
      const double la = loop_length(a);
      const double lb = loop_length(b);
      return la != lb ? la > lb : a < b;
    });
    DisjointSets regions(static_cast<Index>(faces.rows()));
    for (const HalfedgeId h : edges) {
      if (regions.join(h / 3, full_.opposite[static_cast<std::size_t>(h)] / 3)) continue;
      mark(h);
      mark_path(paths, source(faces, h));
      mark_path(paths, target(faces, h));
    }
    rejoin();
    prune();
    return std::move(cut_);
  }

 private:
  // Without the fans the surface may have fallen apart where shortest paths tie and reach a rim
  // beside its fan. Two planar pieces joined along one edge are one planar piece.
  void rejoin() {
    DisjointSets pieces(static_cast<Index>(cut_.size() / 3));
    for (const bool cut : {false, true}) {
      for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut_.size()); ++h) {
        const HalfedgeId o = adjacency_.opposite[static_cast<std::size_t>(h)];
        if (o < h || (cut_[static_cast<std::size_t>(h)] != 0) != cut) continue;
        if (pieces.join(h / 3, o / 3) && cut)
          cut_[static_cast<std::size_t>(h)] = cut_[static_cast<std::size_t>(o)] = 0;
      }
    }
  }

  bool avoids(VertexId v) const {
    return !avoided_.empty() && v < real_vertices_ && avoided_[static_cast<std::size_t>(v)] != 0;
  }

  // Longer than any detour, so that a path has as few avoided vertices as can be.
  void lengthen_at_avoided() {
    double detour = 1.0;
    for (const double length : length_) detour += length;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length_.size()); ++h) {
      const VertexId a = source(filled_.faces, h);
      const VertexId b = target(filled_.faces, h);
      if (a >= real_vertices_ || b >= real_vertices_) continue;
      length_[static_cast<std::size_t>(h)] += detour * (int{avoids(a)} + int{avoids(b)});
    }
  }

  // Where loops meet.
  VertexId any_root() const {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency_.opposite.size()); ++h) {
      if (!avoids(source(filled_.faces, h))) return source(filled_.faces, h);
    }
    return source(filled_.faces, 0);
  }

  void mark(HalfedgeId h) {
    if (length_[static_cast<std::size_t>(h)] == ShortestPaths::kUnreached)
      refuse_uncuttable(source(filled_.faces, h));
    const HalfedgeId o = full_.opposite[static_cast<std::size_t>(h)];
    // Fan edges are not edges of the surface, and the rim of a hole is open already.
    const auto real = static_cast<HalfedgeId>(cut_.size());
    if (h >= real || o >= real) return;
    cut_[static_cast<std::size_t>(h)] = cut_[static_cast<std::size_t>(o)] = 1;
  }

  void mark_path(const ShortestPaths& paths, VertexId v) {
    while (paths.arrival(v) != kInvalid) {
      mark(paths.arrival(v));
      v = paths.before(v);
    }
  }

  ShortestPaths paths_from(VertexId v) const {
    ShortestPaths paths(filled_.faces, full_, length_);
    paths.add_source(v);
    paths.grow(context_);
    for (VertexId w = 0; w < real_vertices_; ++w) {
      const bool used = adjacency_.vertex_halfedge[static_cast<std::size_t>(w)] != kInvalid;
      if (used && paths.distance(w) == ShortestPaths::kUnreached) refuse_uncuttable(w);
    }
    return paths;
  }

  // One to which a path leads straight from the root.
  VertexId neighbour(VertexId root, const ShortestPaths& paths) const {
    for (VertexId v = 0; v < real_vertices_; ++v) {
      if (paths.arrival(v) != kInvalid && paths.before(v) == root) return v;
    }
    refuse_uncuttable(root);
  }

  VertexId farthest(const ShortestPaths& paths) const {
    VertexId best = 0;
    double distance = -1.0;
    bool avoided = true;
    for (VertexId v = 0; v < real_vertices_; ++v) {
      const double d = paths.distance(v);
      if (d >= ShortestPaths::kUnreached) continue;
      if (avoids(v) != avoided ? avoided : d > distance) {
        best = v;
        distance = d;
        avoided = avoids(v);
      }
    }
    return best;
  }

  bool on_rim(VertexId v) const {
    const HalfedgeId start = adjacency_.vertex_halfedge[static_cast<std::size_t>(v)];
    return adjacency_.opposite[static_cast<std::size_t>(start)] == kInvalid;
  }

  // Paths from the root that all loops share beyond its last branch dangle: removes leaves until
  // none is left.
  void prune() {
    std::vector<Index> degree(static_cast<std::size_t>(real_vertices_), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut_.size()); ++h) {
      if (cut_[static_cast<std::size_t>(h)] != 0)
        ++degree[static_cast<std::size_t>(source(filled_.faces, h))];
    }
    std::vector<VertexId> leaves;
    for (VertexId v = 0; v < real_vertices_; ++v) {
      if (degree[static_cast<std::size_t>(v)] == 1 && !on_rim(v)) leaves.push_back(v);
    }
    while (!leaves.empty()) {
      const VertexId v = leaves.back();
      leaves.pop_back();
      if (degree[static_cast<std::size_t>(v)] != 1) continue;
      HalfedgeId h = adjacency_.vertex_halfedge[static_cast<std::size_t>(v)];
      while (cut_[static_cast<std::size_t>(h)] == 0) h = rotate_ccw(adjacency_, h);
      const HalfedgeId o = adjacency_.opposite[static_cast<std::size_t>(h)];
      cut_[static_cast<std::size_t>(h)] = cut_[static_cast<std::size_t>(o)] = 0;
      const VertexId w = target(filled_.faces, h);
      --degree[static_cast<std::size_t>(v)];
      if (--degree[static_cast<std::size_t>(w)] == 1 && !on_rim(w)) leaves.push_back(w);
    }
  }

  const Adjacency& adjacency_;  // of the surface as it is
  const ExecutionContext& context_;
  const std::vector<char>& avoided_;
  Index real_vertices_;
  Surface filled_;  // faces of the surface first
  Adjacency full_;  // of the filled surface
  std::vector<double> length_;
  EdgeFlags cut_;
};

}  // namespace

EdgeFlags planar_cut(const Surface& surface, const Adjacency& adjacency,
                     const ExecutionContext& context, const EdgeFlags& uncuttable,
                     const std::vector<char>& avoided, const std::vector<double>& cost) {
  const Topology shape = topology(surface.faces, adjacency);
  if (shape.boundary_loops > 0 && shape.genus() == 0)
    return EdgeFlags(adjacency.opposite.size(), 0);
  // Infinite lengths would pass for edges that must not be cut.
  const InOwnUnit scaled(surface);
  PlanarCutter cutter(scaled.surface(), adjacency, context, uncuttable, avoided, cost);
  return shape.genus() == 0 ? cutter.open_sphere() : cutter.open_handles();
}

}  // namespace flipfree::mesh
