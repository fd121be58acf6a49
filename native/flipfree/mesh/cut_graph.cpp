#include "flipfree/mesh/cut_graph.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/shortest_paths.h"

namespace flipfree::mesh {

namespace {

[[noreturn]] void refuse_uncuttable(VertexId v) {
  throw_invalid(ErrorCode::kBadOption,
                "The uncuttable edges leave no way to cut the surface open at vertex " +
                    vertex_id(v) + ". Leave some of them out.",
                ElementKind::kVertex, {v});
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

// Marks from v back to the path's source: mark(half-edge) until it is false.
template <typename Mark>
void mark_path(const ShortestPaths& paths, VertexId v, const Mark& mark) {
  while (paths.arrival(v) != kInvalid && mark(paths.arrival(v))) v = paths.before(v);
}

// Per half-edge.
std::vector<double> edge_lengths(const Surface& surface) {
  std::vector<double> length;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(surface.faces.size()); ++h)
    length.push_back((surface.vertices.row(source(surface.faces, h)) -
                      surface.vertices.row(target(surface.faces, h)))
                         .norm());
  return length;
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
        filled_(fill_holes(surface, boundary_halfedge_loops(surface.faces, adjacency))),
        full_(filled_.adjacency()),
        length_(edge_lengths(filled_)),
        cut_(adjacency.opposite.size(), 0) {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length_.size()); ++h)
      if (!is_real(h)) length_[at(h)] = 0.0;
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
    mark_path(paths, end, [&](HalfedgeId h) { return mark(h); });
    if (paths.arrival(end) != kInvalid && paths.before(end) == root) {
      // A single edge opens nothing: go on by one more.
      const HalfedgeId last = full_.opposite[at(paths.arrival(end))];
      HalfedgeId next = rotate_ccw(full_, last);
      while (length_[at(next)] == ShortestPaths::kUnreached) {
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
    const EdgeFlags none(full_.opposite.size(), 0);
    for (const HalfedgeId h : closing_edges(faces, full_, none, paths, length_, context_)) {
      mark(h);
      for (const VertexId v : {source(faces, h), target(faces, h)})
        mark_path(paths, v, [&](HalfedgeId e) { return mark(e); });
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
        const HalfedgeId o = adjacency_.opposite[at(h)];
        if (o < h || (cut_[at(h)] != 0) != cut) continue;
        if (pieces.join(h / 3, o / 3) && cut) cut_[at(h)] = cut_[at(o)] = 0;
      }
    }
  }

  // Of the surface, not of a fan.
  bool is_real(HalfedgeId h) const {
    return std::max(source(filled_.faces, h), target(filled_.faces, h)) < real_vertices_;
  }
  bool avoids(VertexId v) const {
    return !avoided_.empty() && v < real_vertices_ && avoided_[at(v)] != 0;
  }

  // Longer than any detour, so that a path has as few avoided vertices as can be.
  void lengthen_at_avoided() {
    double detour = 1.0;
    for (const double length : length_) detour += length;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length_.size()); ++h) {
      const VertexId a = source(filled_.faces, h), b = target(filled_.faces, h);
      if (is_real(h)) length_[at(h)] += detour * (int{avoids(a)} + int{avoids(b)});
    }
  }

  // Where loops meet.
  VertexId any_root() const {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency_.opposite.size()); ++h) {
      if (!avoids(source(filled_.faces, h))) return source(filled_.faces, h);
    }
    return source(filled_.faces, 0);
  }

  bool mark(HalfedgeId h) {
    if (length_[at(h)] == ShortestPaths::kUnreached) refuse_uncuttable(source(filled_.faces, h));
    const HalfedgeId o = full_.opposite[at(h)];
    // Fan edges are not edges of the surface, and the rim of a hole is open already.
    const auto real = static_cast<HalfedgeId>(cut_.size());
    if (h < real && o < real) cut_[at(h)] = cut_[at(o)] = 1;
    return true;  // of a path all
  }

  ShortestPaths paths_from(VertexId v) const {
    ShortestPaths paths(filled_.faces, full_, length_);
    paths.add_source(v);
    paths.grow(context_);
    for (VertexId w = 0; w < real_vertices_; ++w) {
      const bool used = adjacency_.vertex_halfedge[at(w)] != kInvalid;
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
    const HalfedgeId start = adjacency_.vertex_halfedge[at(v)];
    return adjacency_.opposite[at(start)] == kInvalid;
  }

  // Paths from the root that all loops share beyond its last branch dangle: removes leaves until
  // none is left.
  void prune() {
    std::vector<Index> degree(static_cast<std::size_t>(real_vertices_), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut_.size()); ++h) {
      if (cut_[at(h)] != 0) ++degree[at(source(filled_.faces, h))];
    }
    std::vector<VertexId> leaves;
    for (VertexId v = 0; v < real_vertices_; ++v) {
      if (degree[at(v)] == 1 && !on_rim(v)) leaves.push_back(v);
    }
    while (!leaves.empty()) {
      const VertexId v = leaves.back();
      leaves.pop_back();
      if (degree[at(v)] != 1) continue;
      HalfedgeId h = adjacency_.vertex_halfedge[at(v)];
      while (cut_[at(h)] == 0) h = rotate_ccw(adjacency_, h);
      const HalfedgeId o = adjacency_.opposite[at(h)];
      cut_[at(h)] = cut_[at(o)] = 0;
      const VertexId w = target(filled_.faces, h);
      --degree[at(v)];
      if (--degree[at(w)] == 1 && !on_rim(w)) leaves.push_back(w);
    }
  }

  const Adjacency& adjacency_;  // of the surface as it is
  const ExecutionContext& context_;
  const std::vector<char>& avoided_;
  Index real_vertices_;
  Surface filled_;         // faces of the surface first
  const Adjacency& full_;  // of the filled surface
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

namespace {

// Per half-edge; those that shall be avoided are longer than any path along others.
std::vector<double> path_lengths(const Surface& surface, const EdgeFlags& avoided) {
  std::vector<double> length = edge_lengths(surface);
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
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (adjacency.opposite[at(h)] != kInvalid && !cut[at(h)]) continue;
    open[at(source(faces, h))] = open[at(target(faces, h))] = 1;
    has_open[at(components.of_face[at(h / 3)])] = 1;
  }
  std::vector<VertexId> chosen(at(components.count), kInvalid);
  const auto choose = [&](VertexId v) {
    const HalfedgeId h = adjacency.vertex_halfedge[at(v)];
    if (h == kInvalid) return;
    VertexId& own = chosen[at(components.of_face[at(h / 3)])];
    if (own == kInvalid) own = v;
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

// Empty if the cut is what cut_to_disks() promises: both half-edges of a cut edge flagged, none on
// the boundary, every piece a disk, every interior cone on the cut. Otherwise what is broken. Cost:
// O(#F).
std::string find_broken_disks(const Surface& surface, const Adjacency& adjacency,
                              const EdgeFlags& cut, const std::vector<VertexId>& cones) {
  const Triangles& faces = surface.faces;
  if (cut.size() != adjacency.opposite.size()) return "not one flag per half-edge";
  std::vector<char> open(at(surface.vertices.rows()), 0);
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
    if (!topology(chart.surface.faces, chart.surface.adjacency()).is_disk())
      return "the piece of face " + std::to_string(chart.faces.front()) + " is no disk";
  }
  return {};
}

}  // namespace

EdgeFlags cut_to_disks(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& given,
                       const std::vector<VertexId>& cones, const EdgeFlags& avoided,
                       const ExecutionContext& context) {
  const Triangles& faces = surface.faces;
  EdgeFlags cut = given.empty() ? EdgeFlags(adjacency.opposite.size(), 0) : given;
  const std::vector<double> length = path_lengths(surface, avoided);
  ShortestPaths forest(faces, adjacency, length);
  for (const VertexId v : forest_sources(faces, adjacency, cut, cones)) forest.add_source(v);
  forest.grow(context);

  // False: it, and so the rest of its path, is cut already.
  const auto mark = [&](HalfedgeId h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || cut[at(h)]) return false;
    cut[at(h)] = cut[at(o)] = 1;
    return true;
  };
  for (const HalfedgeId h : closing_edges(faces, adjacency, cut, forest, length, context)) {
    mark(h);
    for (const VertexId v : {source(faces, h), target(faces, h)}) mark_path(forest, v, mark);
  }
  // The cones by the shortest way to what is cut by now.
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (!cut[at(h)]) continue;
    for (const VertexId v : {source(faces, h), target(faces, h)}) {
      if (forest.distance(v) > 0.0) forest.add_source(v);
    }
  }
  forest.grow(context);
  for (const VertexId v : cones) mark_path(forest, v, mark);  // one of no face has none
  debug_check("cut_to_disks", [&] { return find_broken_disks(surface, adjacency, cut, cones); });
  return cut;
}

}  // namespace flipfree::mesh
