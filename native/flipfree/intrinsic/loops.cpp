#include "flipfree/intrinsic/loops.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"

namespace flipfree::intrinsic {

void go_across(DualLoop& strip, HalfedgeId side, const std::vector<HalfedgeId>& opposite) {
  if (!strip.empty() && strip.back() == opposite[at(side)]) {
    strip.pop_back();
  } else {
    strip.push_back(side);
  }
}

void close_strip(DualLoop& strip, const std::vector<HalfedgeId>& opposite) {
  std::size_t first = 0;
  while (first + 1 < strip.size() && strip[first] == opposite[at(strip.back())]) {
    strip.pop_back();
    ++first;
  }
  strip.erase(strip.begin(), strip.begin() + static_cast<std::ptrdiff_t>(first));
}

namespace {

// A tree of shortest paths from face to face across edges, from the first face of every component.
struct DualTree {
  std::vector<double> distance;     // per face
  std::vector<HalfedgeId> entered;  // crossed last, in the face before; kInvalid at roots
  std::vector<Index> depth;         // edges to the root
};

DualTree dual_tree(const mesh::Adjacency& adjacency, const std::vector<double>& step,
                   const ExecutionContext& context) {
  const std::size_t count = adjacency.opposite.size() / 3;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  DualTree tree{std::vector<double>(count, kFar), std::vector<HalfedgeId>(count, kInvalid),
                std::vector<Index>(count, 0)};
  using Entry = std::pair<double, FaceId>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::size_t done = 0;
  for (FaceId root = 0; at(root) < count; ++root) {
    if (tree.distance[at(root)] < kFar) continue;
    tree.distance[at(root)] = 0.0;
    queue.push({0.0, root});
    while (!queue.empty()) {
      const auto [distance, f] = queue.top();
      queue.pop();
      if (distance > tree.distance[at(f)]) continue;
      if (++done % 4096 == 0) context.check();
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        const double further = distance + step[at(h)];
        if (o == kInvalid || !(further < tree.distance[at(o / 3)])) continue;
        tree.distance[at(o / 3)] = further;
        tree.entered[at(o / 3)] = h;
        tree.depth[at(o / 3)] = tree.depth[at(f)] + 1;
        queue.push({further, o / 3});
      }
    }
  }
  return tree;
}

// One half-edge of every edge inside that the tree does not cross, those first whose loops are
// long.
std::vector<HalfedgeId> uncrossed(const mesh::Adjacency& adjacency, const DualTree& tree,
                                  const std::vector<double>& step) {
  std::vector<char> crossed(step.size(), 0);
  for (const HalfedgeId h : tree.entered) {
    if (h != kInvalid) crossed[at(h)] = crossed[at(adjacency.opposite[at(h)])] = 1;
  }
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; at(h) < step.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o < h || crossed[at(h)] != 0) continue;
    edges.emplace_back(-(tree.distance[at(h / 3)] + tree.distance[at(o / 3)] + step[at(h)]), h);
  }
  std::sort(edges.begin(), edges.end());
  std::vector<HalfedgeId> sorted;
  for (const auto& [length, h] : edges) sorted.push_back(h);
  return sorted;
}

// The half-edges that are crossed on the way from face `a` to face `b` of one component through the
// tree, without what the ways to both share: towards the root, then away from it.
std::pair<DualLoop, DualLoop> path_between(const mesh::Adjacency& adjacency, const DualTree& tree,
                                           FaceId a, FaceId b) {
  DualLoop up, down;
  while (a != b) {
    FaceId& lower = tree.depth[at(a)] >= tree.depth[at(b)] ? a : b;
    const HalfedgeId entered = tree.entered[at(lower)];
    if (&lower == &a) {
      up.push_back(adjacency.opposite[at(entered)]);
    } else {
      down.push_back(entered);
    }
    lower = entered / 3;
  }
  std::reverse(down.begin(), down.end());
  return {std::move(up), std::move(down)};
}

// From centre to centre of the faces beside each edge, over its middle: per half-edge; 0 at the
// boundary.
std::vector<double> steps_across(const mesh::Surface& surface) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<double> half(adjacency.opposite.size());
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const Vector3 a = surface.vertices.row(mesh::source(surface.faces, h));
    const Vector3 b = surface.vertices.row(mesh::target(surface.faces, h));
    const Vector3 c = surface.vertices.row(mesh::source(surface.faces, previous_corner(h)));
    half[at(h)] = (c - 0.5 * (a + b)).norm() / 3.0;
  }
  std::vector<double> step(half.size(), 0.0);
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid) step[at(h)] = half[at(h)] + half[at(o)];
  }
  return step;
}

std::vector<VertexId> boundary_as_points(const Triangles& faces, const mesh::Adjacency& adjacency) {
  std::vector<VertexId> stands_for(adjacency.vertex_halfedge.size());
  std::iota(stands_for.begin(), stands_for.end(), 0);
  for (const std::vector<VertexId>& loop : mesh::boundary_loops(faces, adjacency)) {
    for (const VertexId v : loop) stands_for[at(v)] = loop.front();
  }
  return stands_for;
}

}  // namespace

TreeCotree tree_cotree(const mesh::Surface& surface, const ExecutionContext& context) {
  const Triangles& faces = surface.faces;
  const mesh::Adjacency& adjacency = surface.adjacency();
  const std::vector<double> step = steps_across(surface);
  const DualTree tree = dual_tree(adjacency, step, context);
  TreeCotree out;
  out.stands_for = boundary_as_points(faces, adjacency);
  DisjointSets sets(static_cast<Index>(out.stands_for.size()));
  std::vector<std::vector<HalfedgeId>> around(out.stands_for.size());  // they point to the vertex
  for (const HalfedgeId h : uncrossed(adjacency, tree, step)) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    const VertexId a = out.stands_for[at(mesh::source(faces, h))];
    const VertexId b = out.stands_for[at(mesh::target(faces, h))];
    if (sets.join(a, b)) {
      around[at(b)].push_back(h);
      around[at(a)].push_back(o);
      continue;
    }
    out.left_over.push_back(h);
    // From the tree's root across h and back.
    auto [up, loop] = path_between(adjacency, tree, o / 3, h / 3);
    loop.push_back(h);
    loop.insert(loop.end(), up.begin(), up.end());
    out.loops.push_back(std::move(loop));
  }
  out.to_parent.assign(out.stands_for.size(), kInvalid);
  std::vector<char> seen(out.stands_for.size(), 0);
  for (VertexId root = 0; at(root) < seen.size(); ++root) {
    if (seen[at(root)] != 0 || out.stands_for[at(root)] != root) continue;
    seen[at(root)] = 1;
    out.order.push_back(root);
    for (std::size_t i = out.order.size() - 1; i < out.order.size(); ++i) {
      for (const HalfedgeId h : around[at(out.order[i])]) {
        const VertexId child = out.stands_for[at(mesh::source(faces, h))];
        if (std::exchange(seen[at(child)], 1) != 0) continue;
        out.to_parent[at(child)] = h;
        out.order.push_back(child);
      }
    }
  }
  return out;
}

EdgeChain tree_path(const mesh::Surface& surface, const TreeCotree& tree, VertexId from,
                    VertexId to) {
  const auto to_root = [&](VertexId v) {
    EdgeChain chain;
    for (HalfedgeId up = tree.to_parent[at(tree.stands_for[at(v)])]; up != kInvalid;
         up = tree.to_parent[at(tree.stands_for[at(mesh::target(surface.faces, up))])])
      chain.push_back(up);
    return chain;
  };
  EdgeChain chain = to_root(from), before = to_root(to);
  while (!chain.empty() && !before.empty() && chain.back() == before.back()) {
    chain.pop_back();
    before.pop_back();
  }
  for (auto up = before.rbegin(); up != before.rend(); ++up)
    chain.push_back(surface.adjacency().opposite[at(*up)]);
  return chain;
}

EdgeChain chain_of(const mesh::Surface& surface, const TreeCotree& tree, std::size_t i) {
  // h is left by the loop, so it runs from the loop's right to its left.
  const HalfedgeId h = tree.left_over[i];
  EdgeChain chain =
      tree_path(surface, tree, mesh::target(surface.faces, h), mesh::source(surface.faces, h));
  chain.insert(chain.begin(), h);
  return chain;
}

std::vector<DualLoop> strips_between(const mesh::Surface& surface,
                                     const ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const DualTree tree = dual_tree(adjacency, steps_across(surface), context);
  std::vector<HalfedgeId> nearest;  // to the root, of each boundary loop
  for (const auto& boundary : mesh::boundary_halfedge_loops(surface.faces, adjacency)) {
    nearest.push_back(
        *std::min_element(boundary.begin(), boundary.end(), [&](HalfedgeId a, HalfedgeId b) {
          const double x = tree.distance[at(a / 3)], y = tree.distance[at(b / 3)];
          return x != y ? x < y : a < b;
        }));
  }
  std::vector<DualLoop> strips;
  for (std::size_t i = 1; i < nearest.size(); ++i) {
    const auto [up, down] = path_between(adjacency, tree, nearest[0] / 3, nearest[i] / 3);
    DualLoop& strip = strips.emplace_back(1, nearest[0]);
    strip.insert(strip.end(), up.begin(), up.end());
    strip.insert(strip.end(), down.begin(), down.end());
    strip.push_back(nearest[i]);
  }
  return strips;
}

LoopCarrier::LoopCarrier(FlipMesh mesh, const std::vector<DualLoop>& loops)
    : mesh_(std::move(mesh)), on_edge_(mesh_.next.size() / 2, kInvalid) {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    first_.push_back(kInvalid);
    Index last = kInvalid;
    for (const HalfedgeId h : loops[i]) last = insert(h, static_cast<Index>(i), last);
  }
}

Index LoopCarrier::insert(HalfedgeId h, Index loop, Index after) {
  Index id = static_cast<Index>(nodes_.size());
  if (unused_.empty()) {
    nodes_.emplace_back();
  } else {
    id = unused_.back();
    unused_.pop_back();
  }
  Node& node = nodes_[at(id)];
  node.halfedge = h;
  node.loop = loop;
  if (after == kInvalid) {
    node.next = node.previous = id;
    first_[at(loop)] = id;
  } else {
    node.previous = after;
    node.next = nodes_[at(after)].next;
    nodes_[at(node.next)].previous = id;
    nodes_[at(after)].next = id;
  }
  Index& top = on_edge_[at(h >> 1)];
  node.above = kInvalid;
  node.below = top;
  if (top != kInvalid) nodes_[at(top)].above = id;
  top = id;
  return id;
}

void LoopCarrier::remove(Index id) {
  const Node& node = nodes_[at(id)];
  nodes_[at(node.previous)].next = node.next;
  nodes_[at(node.next)].previous = node.previous;
  if (first_[at(node.loop)] == id) first_[at(node.loop)] = node.next;
  if (node.below != kInvalid) nodes_[at(node.below)].above = node.above;
  (node.above == kInvalid ? on_edge_[at(node.halfedge >> 1)] : nodes_[at(node.above)].below) =
      node.below;
  unused_.push_back(id);
}

// Loops that enter the face of `side` and `diagonal` across `side`: those that leave the
// quadrilateral from the other face cross the diagonal.
void LoopCarrier::cross_new_diagonal(HalfedgeId side, HalfedgeId diagonal) {
  const HalfedgeId from_outside = FlipMesh::opposite(side);
  for (Index id = on_edge_[at(side >> 1)]; id != kInvalid; id = nodes_[at(id)].below) {
    if (nodes_[at(id)].halfedge != from_outside) continue;
    const HalfedgeId leaving = nodes_[at(nodes_[at(id)].next)].halfedge;
    const bool same_face =
        leaving == mesh_.next_of(diagonal) || leaving == mesh_.previous(diagonal);
    if (!same_face) insert(diagonal, nodes_[at(id)].loop, id);
  }
}

void LoopCarrier::flip(EdgeId e) {
  while (on_edge_[at(e)] != kInvalid) remove(on_edge_[at(e)]);
  const HalfedgeId h = 2 * e;
  flip_edge(mesh_, e);
  for (const HalfedgeId diagonal : {h, h + 1}) {
    cross_new_diagonal(mesh_.next_of(diagonal), diagonal);
    cross_new_diagonal(mesh_.previous(diagonal), diagonal);
  }
}

DualLoop LoopCarrier::loop(std::size_t i) const {
  DualLoop loop;
  Index node = first_[i];
  do {
    loop.push_back(nodes_[at(node)].halfedge);
    node = nodes_[at(node)].next;
  } while (node != first_[i]);
  return loop;
}

DualLoop closed_by_reflection(const IntrinsicMesh& mesh, const DualLoop& strip) {
  DualLoop loop = strip;
  for (std::size_t i = strip.size() - 2; i > 0; --i)
    loop.push_back(mesh.reflection[at(FlipMesh::opposite(strip[i]))]);
  return loop;
}

std::vector<DualLoop> on_setup(const std::vector<DualLoop>& loops, const Triangles& faces,
                               const IntrinsicSetup& setup) {
  const auto corner_count = static_cast<HalfedgeId>(3 * faces.rows());
  std::vector<HalfedgeId> corner_of(setup.mesh.halfedge_count(), kInvalid);
  for (HalfedgeId c = 0; c < corner_count; ++c) corner_of[at(setup.input_halfedge[at(c)])] = c;
  std::vector<DualLoop> out;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const DualLoop& loop = loops[i];
    DualLoop own;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const HalfedgeId after = loop[(k + 1) % loop.size()];
      const bool inside =
          loop[k] >= 0 && loop[k] < corner_count && after >= 0 && after < corner_count;
      const HalfedgeId entered =
          inside ? corner_of[at(setup.input_halfedge[at(loop[k])] ^ 1)] : kInvalid;
      if (!inside || entered / 3 != after / 3 || entered == after) {
        throw_invalid(ErrorCode::kBadOption,
                      "Loop " + std::to_string(i) + " is not a closed strip of faces at place " +
                          std::to_string(k) +
                          ". Give half-edges across each of which the loop enters the face of the "
                          "next one, without turning back.");
      }
      own.push_back(setup.input_halfedge[at(loop[k])]);
    }
    if (own.empty())
      throw_invalid(ErrorCode::kBadOption,
                    "Loop " + std::to_string(i) + " is empty. Leave it out.");
    out.push_back(std::move(own));
  }
  return out;
}

}  // namespace flipfree::intrinsic
