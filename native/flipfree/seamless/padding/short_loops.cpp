#include "flipfree/seamless/padding/short_loops.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"

namespace flipfree::seamless {

namespace {

// Loops of one round may be so much longer than its shortest one.
constexpr double kNotMuchLonger = 2.0;

// Shortest paths from a root through free vertices.
class FreeTree {
 public:
  FreeTree(const Canvas& canvas, VertexId root, const ExecutionContext& context)
      : canvas_(canvas),
        found_(free_distances(canvas, {}, root, context)),
        depth_(found_.distance.size(), 0) {
    for (const VertexId v : found_.order) {
      if (v != root) depth_[at(v)] = depth_[at(parent(v))] + 1;
    }
  }

  bool has(HalfedgeId h) const {
    return found_.arrival[at(canvas_.mesh().target(h))] == h ||
           found_.arrival[at(canvas_.mesh().source(h))] == canvas_.mesh().opposite(h);
  }
  // Of the cycle that h closes.
  double cycle_length(HalfedgeId h) const {
    const VertexId a = canvas_.mesh().source(h);
    const VertexId b = canvas_.mesh().target(h);
    return found_.distance[at(a)] + canvas_.length(h) + found_.distance[at(b)] -
           2.0 * found_.distance[at(meet(a, b))];
  }
  std::vector<VertexId> cycle(HalfedgeId h) const {
    VertexId a = canvas_.mesh().source(h);
    VertexId b = canvas_.mesh().target(h);
    const VertexId top = meet(a, b);
    std::vector<VertexId> back;
    for (; a != top; a = parent(a)) back.push_back(a);
    back.push_back(top);
    std::vector<VertexId> cycle(back.rbegin(), back.rend());
    for (; b != top; b = parent(b)) cycle.push_back(b);
    return cycle;
  }

 private:
  VertexId parent(VertexId v) const { return canvas_.mesh().source(found_.arrival[at(v)]); }
  // Their lowest common ancestor.
  VertexId meet(VertexId a, VertexId b) const {
    while (a != b) {
      VertexId& lower = depth_[at(a)] >= depth_[at(b)] ? a : b;
      lower = parent(lower);
    }
    return a;
  }

  const Canvas& canvas_;
  FreeDistances found_;
  std::vector<Index> depth_;
};

// The edges that neither tree nor cotree has, by rising length of their cycles.
std::vector<HalfedgeId> left_over(const Canvas& canvas, const FreeTree& tree,
                                  const ExecutionContext& context) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  DisjointSets regions(mesh.face_slots());
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    const HalfedgeId o = mesh.opposite(h);
    if (h > o || canvas.is_drawn(h)) continue;
    if (!canvas.is_free(mesh.source(h)) || !canvas.is_free(mesh.target(h))) {
      // Not in the graph of free vertices: a curve and a cone with what is around them are one face
      // of it.
      regions.join(h / 3, o / 3);
    } else if (!tree.has(h)) {
      edges.emplace_back(-tree.cycle_length(h), h);
    }
  }
  context.check();
  std::sort(edges.begin(), edges.end());
  std::vector<HalfedgeId> left;
  for (const auto& [length, h] : edges) {
    if (!regions.join(h / 3, mesh.opposite(h) / 3)) left.push_back(h);
  }
  std::reverse(left.begin(), left.end());
  return left;
}

// Told by the order of faces, not by the numbers of vertices.
VertexId any_free(const Canvas& canvas) {
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); ++h) {
    if (canvas.is_free(canvas.mesh().source(h))) return canvas.mesh().source(h);
  }
  throw InternalError("a refined surface without free vertices");
}

// Some of the cycles of one tree, disjoint.
Loops round_of_loops(const Canvas& canvas, std::size_t most, const CycleTurns& wished,
                     const ExecutionContext& context) {
  const auto edges_left = [&](const FreeTree& tree) {
    std::vector<HalfedgeId> left = left_over(canvas, tree, context);
    if (left.empty()) throw InternalError("fewer handles than the genus");
    return left;
  };
  // Cycles are shortest through the root: one on the shortest cycle of any tree is a better root.
  const FreeTree any_tree(canvas, any_free(canvas), context);
  const std::vector<VertexId> found = any_tree.cycle(edges_left(any_tree).front());
  const FreeTree tree(canvas, found[found.size() / 2], context);
  const std::vector<HalfedgeId> left = edges_left(tree);
  const double longest = kNotMuchLonger * tree.cycle_length(left.front());
  std::vector<std::pair<Index, std::vector<VertexId>>> cycles;  // with their turns
  for (const HalfedgeId h : left) {
    if (tree.cycle_length(h) > longest) break;
    std::vector<VertexId> cycle = tree.cycle(h);
    const Index turn = wished ? std::abs(wished(cycle)) : 0;
    cycles.emplace_back(turn, std::move(cycle));
  }
  std::stable_sort(cycles.begin(), cycles.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<char> taken(at(canvas.vertex_count()), 0);
  Loops loops;
  for (auto& [turn, cycle] : cycles) {
    if (loops.size() == most) break;
    if (std::any_of(cycle.begin(), cycle.end(), [&](VertexId v) { return taken[at(v)] != 0; }))
      continue;
    for (const VertexId v : cycle) taken[at(v)] = 1;
    loops.push_back(std::move(cycle));
  }
  return loops;
}

}  // namespace

Loops draw_short_loops(Canvas& canvas, Index genus, Loops drawn, const CycleTurns& wished,
                       const ExecutionContext& context) {
  Loops loops = std::move(drawn);
  while (loops.size() < at(genus)) {
    for (std::vector<VertexId>& loop :
         round_of_loops(canvas, at(genus) - loops.size(), wished, context)) {
      // Drawn one by one, an edge between two of them is split before it could be taken for drawn.
      canvas.draw(canvas.edges_of(loop), Curve::kLoop);
      loops.push_back(std::move(loop));
    }
  }
  return loops;
}

}  // namespace flipfree::seamless
