#include "flipfree/intrinsic/loops/dual_loops.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "flipfree/base/disjoint_sets.h"

namespace flipfree::intrinsic {
namespace {

// Faces are named by numbers of their own, in the order of their first half-edge.
struct Faces {
  std::vector<Index> of;        // per half-edge
  std::vector<HalfedgeId> any;  // per face: one of its half-edges
};

Faces number_faces(const FlipMesh& mesh) {
  Faces faces;
  faces.of.assign(mesh.next.size(), kInvalid);
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
    if (faces.of[at(h)] != kInvalid) continue;
    const auto f = static_cast<Index>(faces.any.size());
    faces.any.push_back(h);
    HalfedgeId g = h;
    do {
      faces.of[at(g)] = f;
      g = mesh.next_of(g);
    } while (g != h);
  }
  return faces;
}

// Shortest paths from one face to all, across edges.
struct DualTree {
  std::vector<double> distance;     // per face
  std::vector<HalfedgeId> entered;  // per face: the half-edge crossed last, in the face before;
                                    // kInvalid at the root
  std::vector<Index> depth;         // edges to the root
};

DualTree shortest_paths(const FlipMesh& mesh, const Faces& faces, const std::vector<double>& step,
                        const ExecutionContext& context) {
  const std::size_t count = faces.any.size();
  DualTree tree{std::vector<double>(count, std::numeric_limits<double>::infinity()),
                std::vector<HalfedgeId>(count, kInvalid), std::vector<Index>(count, 0)};
  using Entry = std::pair<double, Index>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  tree.distance[0] = 0.0;
  queue.push({0.0, 0});
  std::size_t done = 0;
  while (!queue.empty()) {
    const auto [distance, f] = queue.top();
    queue.pop();
    if (distance > tree.distance[at(f)]) continue;
    if (++done % 4096 == 0) context.check();
    HalfedgeId h = faces.any[at(f)];
    for (int k = 0; k < 3; ++k, h = mesh.next_of(h)) {
      const Index other = faces.of[at(FlipMesh::opposite(h))];
      const double further = distance + step[at(h >> 1)];
      if (!(further < tree.distance[at(other)])) continue;
      tree.distance[at(other)] = further;
      tree.entered[at(other)] = h;
      tree.depth[at(other)] = tree.depth[at(f)] + 1;
      queue.push({further, other});
    }
  }
  return tree;
}

// Edges in neither tree: of those that the dual tree does not cross, the primal spanning tree takes
// the ones first whose cycles are long.
std::vector<HalfedgeId> generators(const FlipMesh& mesh, const Faces& faces, const DualTree& tree,
                                   const std::vector<double>& step) {
  std::vector<char> crossed(step.size(), 0);
  for (const HalfedgeId h : tree.entered) {
    if (h != kInvalid) crossed[at(h >> 1)] = 1;
  }
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
    const double left = tree.distance[at(faces.of[at(h)])];
    const double right = tree.distance[at(faces.of[at(h + 1)])];
    if (crossed[at(h >> 1)] != 0 || !std::isfinite(std::min(left, right))) continue;
    edges.emplace_back(left + right + step[at(h >> 1)], h);
  }
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  DisjointSets sets(count_vertices(mesh));
  std::vector<HalfedgeId> left;
  for (const auto& [length, h] : edges) {
    if (!sets.join(mesh.origin_of(h), mesh.origin_of(h + 1)) && std::isfinite(length))
      left.push_back(h);
  }
  return left;
}

// From the face of `a` up in the tree and down to the face of `b`, without what both ways share:
// the half-edges crossed, and how many of them lead up.
struct TreePath {
  DualLoop up;    // in order, towards the root
  DualLoop down;  // in order, away from it
};
TreePath path_between(const Faces& faces, const DualTree& tree, Index a, Index b) {
  TreePath path;
  const auto up = [&](Index& f) {
    const HalfedgeId entered = tree.entered[at(f)];
    f = faces.of[at(entered)];
    return entered;
  };
  while (a != b) {
    if (tree.depth[at(a)] >= tree.depth[at(b)]) {
      path.up.push_back(FlipMesh::opposite(up(a)));
    } else {
      path.down.push_back(up(b));
    }
  }
  std::reverse(path.down.begin(), path.down.end());
  return path;
}

// From the tree's root across h and back, without what both ways share.
DualLoop fundamental_cycle(const Faces& faces, const DualTree& tree, HalfedgeId h) {
  const TreePath path =
      path_between(faces, tree, faces.of[at(FlipMesh::opposite(h))], faces.of[at(h)]);
  DualLoop loop = path.down;
  loop.push_back(h);
  loop.insert(loop.end(), path.up.begin(), path.up.end());
  return loop;
}

}  // namespace

std::vector<DualLoop> homology_basis(const FlipMesh& mesh, const std::vector<double>& step,
                                     const ExecutionContext& context) {
  const Faces faces = number_faces(mesh);
  const DualTree tree = shortest_paths(mesh, faces, step, context);
  std::vector<DualLoop> loops;
  for (const HalfedgeId h : generators(mesh, faces, tree, step))
    loops.push_back(fundamental_cycle(faces, tree, h));
  return loops;
}

std::vector<DualLoop> boundary_strips(const FlipMesh& mesh, const std::vector<double>& step,
                                      const ExecutionContext& context) {
  const Faces faces = number_faces(mesh);
  const DualTree tree = shortest_paths(mesh, faces, step, context);
  // Closed curves of barriers, by the vertices on them, each with the half-edge that is nearest.
  DisjointSets sets(count_vertices(mesh));
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
    if (!std::isfinite(step[at(h >> 1)])) sets.join(mesh.origin_of(h), mesh.origin_of(h + 1));
  }
  std::vector<Index> curve_of(at(count_vertices(mesh)), kInvalid);
  std::vector<HalfedgeId> nearest;
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
    const double distance = tree.distance[at(faces.of[at(h)])];
    if (std::isfinite(step[at(h >> 1)]) || !std::isfinite(distance)) continue;
    Index& curve = curve_of[at(sets.find(mesh.origin_of(h)))];
    if (curve == kInvalid) {
      curve = static_cast<Index>(nearest.size());
      nearest.push_back(h);
    }
    HalfedgeId& best = nearest[at(curve)];
    if (distance < tree.distance[at(faces.of[at(best)])]) best = h;
  }
  std::vector<DualLoop> strips;
  for (std::size_t i = 1; i < nearest.size(); ++i) {
    const TreePath path =
        path_between(faces, tree, faces.of[at(nearest.front())], faces.of[at(nearest[i])]);
    DualLoop strip{FlipMesh::opposite(nearest.front())};
    strip.insert(strip.end(), path.up.begin(), path.up.end());
    strip.insert(strip.end(), path.down.begin(), path.down.end());
    strip.push_back(nearest[i]);
    strips.push_back(std::move(strip));
  }
  return strips;
}

// b is pushed to the left of itself until it runs along edges: around the corners on its left. It
// then crosses a wherever a crosses one of these edges.
Index intersection_number(const FlipMesh& mesh, const DualLoop& a, const DualLoop& b) {
  // The edges on the left of b: those of which b passes the target on its left, from corner to
  // corner. As a chain: for each face whose third side b has on its left, that side.
  std::vector<Index> chain(mesh.next.size() / 2, 0);
  for (std::size_t i = 0; i < b.size(); ++i) {
    const HalfedgeId entered = FlipMesh::opposite(b[i]);
    const HalfedgeId leaving = b[(i + 1) % b.size()];
    if (leaving != mesh.next_of(entered)) continue;  // a corner on the left: no side there
    // The third side, previous(entered), runs against b's direction.
    const HalfedgeId side = mesh.previous(entered);
    chain[at(side >> 1)] += (side & 1) == 0 ? -1 : 1;
  }
  Index sum = 0;
  for (const HalfedgeId h : a) sum += (h & 1) == 0 ? chain[at(h >> 1)] : -chain[at(h >> 1)];
  return sum;
}

}  // namespace flipfree::intrinsic
