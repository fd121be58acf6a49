#include "flipfree/field/topology/tree_cotree.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::field {
namespace {

// From centre to centre across each edge, over its middle: per half-edge.
std::vector<double> steps_across(const mesh::Surface& surface, const mesh::Adjacency& adjacency) {
  std::vector<double> half(adjacency.opposite.size());
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const Vector3 a = surface.vertices.row(mesh::source(surface.faces, h));
    const Vector3 b = surface.vertices.row(mesh::target(surface.faces, h));
    const HalfedgeId p = previous_corner(h);
    const Vector3 c = surface.vertices.row(mesh::source(surface.faces, p));
    half[at(h)] = (c - 0.5 * (a + b)).norm() / 3.0;
  }
  std::vector<double> step(half.size(), 0.0);
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid) step[at(h)] = half[at(h)] + half[at(o)];
  }
  return step;
}

struct FaceTree {
  std::vector<double> distance;
  std::vector<HalfedgeId> entered;  // crossed last, in the face before; kInvalid at roots
  std::vector<Index> depth;
};

FaceTree join_faces(const mesh::Adjacency& adjacency, const std::vector<double>& step,
                    const ExecutionContext& context) {
  const std::size_t count = adjacency.opposite.size() / 3;
  FaceTree tree{std::vector<double>(count, std::numeric_limits<double>::infinity()),
                std::vector<HalfedgeId>(count, kInvalid), std::vector<Index>(count, 0)};
  using Entry = std::pair<double, FaceId>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::size_t done = 0;
  for (FaceId root = 0; at(root) < count; ++root) {
    if (tree.distance[at(root)] < std::numeric_limits<double>::infinity()) continue;
    tree.distance[at(root)] = 0.0;
    queue.push({0.0, root});
    while (!queue.empty()) {
      const auto [distance, f] = queue.top();
      queue.pop();
      if (distance > tree.distance[at(f)]) continue;
      if (++done % 4096 == 0) context.check();
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (o == kInvalid) continue;
        const double further = distance + step[at(h)];
        if (!(further < tree.distance[at(o / 3)])) continue;
        tree.distance[at(o / 3)] = further;
        tree.entered[at(o / 3)] = h;
        tree.depth[at(o / 3)] = tree.depth[at(f)] + 1;
        queue.push({further, o / 3});
      }
    }
  }
  return tree;
}

std::vector<VertexId> boundary_as_points(const Triangles& faces, const mesh::Adjacency& adjacency) {
  std::vector<VertexId> stands_for(adjacency.vertex_halfedge.size());
  for (std::size_t v = 0; v < stands_for.size(); ++v) stands_for[v] = static_cast<VertexId>(v);
  for (const std::vector<VertexId>& loop : mesh::boundary_loops(faces, adjacency)) {
    for (const VertexId v : loop) stands_for[at(v)] = loop.front();
  }
  return stands_for;
}

// The tree of vertices takes the edges first whose loops would be long.
void join_vertices(const Triangles& faces, const mesh::Adjacency& adjacency, const FaceTree& tree,
                   const std::vector<double>& step, TreeCotree& out) {
  std::vector<char> crossed(adjacency.opposite.size(), 0);
  for (const HalfedgeId h : tree.entered) {
    if (h != kInvalid) crossed[at(h)] = crossed[at(adjacency.opposite[at(h)])] = 1;
  }
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || o < h || crossed[at(h)] != 0) continue;
    edges.emplace_back(tree.distance[at(h / 3)] + tree.distance[at(o / 3)] + step[at(h)], h);
  }
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  DisjointSets sets(static_cast<Index>(out.stands_for.size()));
  std::vector<std::vector<HalfedgeId>> around(out.stands_for.size());
  for (const auto& [length, h] : edges) {
    const VertexId a = out.stands_for[at(mesh::source(faces, h))];
    const VertexId b = out.stands_for[at(mesh::target(faces, h))];
    if (!sets.join(a, b)) {
      out.left_over.push_back(h);
      continue;
    }
    around[at(b)].push_back(h);
    around[at(a)].push_back(adjacency.opposite[at(h)]);
  }
  // From the roots: `around` has half-edges that point to a vertex.
  out.to_parent.assign(out.stands_for.size(), kInvalid);
  std::vector<char> seen(out.stands_for.size(), 0);
  for (VertexId root = 0; at(root) < seen.size(); ++root) {
    if (seen[at(root)] != 0 || out.stands_for[at(root)] != root) continue;
    seen[at(root)] = 1;
    out.order.push_back(root);
    for (std::size_t i = out.order.size() - 1; i < out.order.size(); ++i) {
      for (const HalfedgeId h : around[at(out.order[i])]) {
        const VertexId child = out.stands_for[at(mesh::source(faces, h))];
        if (seen[at(child)] != 0) continue;
        seen[at(child)] = 1;
        out.to_parent[at(child)] = h;
        out.order.push_back(child);
      }
    }
  }
}

// From the tree's root across h and back, without what both ways share.
intrinsic::DualLoop loop_across(const mesh::Adjacency& adjacency, const FaceTree& tree,
                                HalfedgeId h) {
  FaceId a = h / 3, b = adjacency.opposite[at(h)] / 3;
  intrinsic::DualLoop to, back;
  const auto up = [&](FaceId& f) {
    const HalfedgeId entered = tree.entered[at(f)];
    f = entered / 3;
    return entered;
  };
  while (a != b) {
    if (tree.depth[at(a)] >= tree.depth[at(b)]) {
      to.push_back(up(a));
    } else {
      back.push_back(adjacency.opposite[at(up(b))]);
    }
  }
  std::reverse(to.begin(), to.end());
  to.push_back(h);
  to.insert(to.end(), back.begin(), back.end());
  return to;
}

}  // namespace

TreeCotree tree_cotree(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                       const ExecutionContext& context) {
  const std::vector<double> step = steps_across(surface, adjacency);
  const FaceTree tree = join_faces(adjacency, step, context);
  TreeCotree out;
  out.stands_for = boundary_as_points(surface.faces, adjacency);
  join_vertices(surface.faces, adjacency, tree, step, out);
  for (const HalfedgeId h : out.left_over) out.loops.push_back(loop_across(adjacency, tree, h));
  return out;
}

EdgeChain chain_of(const Triangles& faces, const mesh::Adjacency& adjacency, const TreeCotree& tree,
                   std::size_t i) {
  // h is left by the loop, so it runs from the loop's right to its left.
  const HalfedgeId h = tree.left_over[i];
  const auto to_root = [&](VertexId v) {
    EdgeChain chain;
    for (HalfedgeId up = tree.to_parent[at(tree.stands_for[at(v)])]; up != kInvalid;
         up = tree.to_parent[at(tree.stands_for[at(mesh::target(faces, up))])])
      chain.push_back(up);
    return chain;
  };
  EdgeChain onwards = to_root(mesh::target(faces, h));
  EdgeChain before = to_root(mesh::source(faces, h));
  while (!onwards.empty() && !before.empty() && onwards.back() == before.back()) {
    onwards.pop_back();
    before.pop_back();
  }
  EdgeChain chain{h};
  chain.insert(chain.end(), onwards.begin(), onwards.end());
  for (auto up = before.rbegin(); up != before.rend(); ++up)
    chain.push_back(adjacency.opposite[at(*up)]);
  return chain;
}

}  // namespace flipfree::field
