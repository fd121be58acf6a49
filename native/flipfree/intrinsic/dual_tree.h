// A tree of shortest paths from face to face across edges, and the edges that neither it nor a
// spanning tree of the vertices takes: one for each loop of a homology basis (tree-cotree
// decomposition: Eppstein 2003; Erickson and Whittlesey 2005).
//
// `Dual` is any mesh: face_count(), face_of(h), opposite(h) (kInvalid at a boundary), step(h) (how
// far it is across, infinite at barriers, which nothing crosses), for_each_side(f, visit).
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::intrinsic {

struct DualTree {
  std::vector<double> distance;     // per face, infinite where it does not reach
  std::vector<HalfedgeId> entered;  // crossed last, in the face before; kInvalid at roots
  std::vector<Index> depth;         // edges to the root
};

// From the first face of every component, or of the first one alone. Cost: O(#F log #F).
template <typename Dual>
DualTree dual_tree(const Dual& dual, bool all_components, const ExecutionContext& context) {
  const std::size_t count = dual.face_count();
  constexpr double kFar = std::numeric_limits<double>::infinity();
  DualTree tree{std::vector<double>(count, kFar), std::vector<HalfedgeId>(count, kInvalid),
                std::vector<Index>(count, 0)};
  using Entry = std::pair<double, FaceId>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::size_t done = 0;
  for (FaceId root = 0; at(root) < (all_components ? count : 1); ++root) {
    if (tree.distance[at(root)] < kFar) continue;
    tree.distance[at(root)] = 0.0;
    queue.push({0.0, root});
    while (!queue.empty()) {
      const auto [distance, f] = queue.top();
      queue.pop();
      if (distance > tree.distance[at(f)]) continue;
      if (++done % 4096 == 0) context.check();
      dual.for_each_side(f, [&, distance = distance, f = f](HalfedgeId h) {
        const HalfedgeId o = dual.opposite(h);
        if (o == kInvalid) return;
        const FaceId other = dual.face_of(o);
        const double further = distance + dual.step(h);
        if (!(further < tree.distance[at(other)])) return;
        tree.distance[at(other)] = further;
        tree.entered[at(other)] = h;
        tree.depth[at(other)] = tree.depth[at(f)] + 1;
        queue.push({further, other});
      });
    }
  }
  return tree;
}

// Calls take(h) for one half-edge of every edge that the tree does not cross, those first whose
// loops are long: what a spanning tree of the vertices takes in this order leaves the short ones.
template <typename Dual, typename Take>
void for_each_uncrossed(const Dual& dual, const DualTree& tree, HalfedgeId halfedges,
                        const Take& take) {
  std::vector<char> crossed(at(halfedges), 0);
  for (const HalfedgeId h : tree.entered) {
    if (h != kInvalid) crossed[at(h)] = crossed[at(dual.opposite(h))] = 1;
  }
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; h < halfedges; ++h) {
    const HalfedgeId o = dual.opposite(h);
    if (o < h || crossed[at(h)] != 0) continue;
    const double left = tree.distance[at(dual.face_of(h))];
    const double right = tree.distance[at(dual.face_of(o))];
    if (std::isfinite(std::min(left, right))) edges.emplace_back(left + right + dual.step(h), h);
  }
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  for (const auto& [length, h] : edges) take(length, h);
}

// The half-edges that are crossed on the way from face `a` to face `b` of one component through the
// tree, without what the ways to both share.
struct TreePath {
  std::vector<HalfedgeId> up;    // in order, towards the root
  std::vector<HalfedgeId> down;  // in order, away from it
};
template <typename Dual>
TreePath path_between(const Dual& dual, const DualTree& tree, FaceId a, FaceId b) {
  TreePath path;
  const auto up = [&](FaceId& f) {
    const HalfedgeId entered = tree.entered[at(f)];
    f = dual.face_of(entered);
    return entered;
  };
  while (a != b) {
    if (tree.depth[at(a)] >= tree.depth[at(b)]) {
      path.up.push_back(dual.opposite(up(a)));
    } else {
      path.down.push_back(up(b));
    }
  }
  std::reverse(path.down.begin(), path.down.end());
  return path;
}

// From the tree's root across h and back, without what both ways share.
template <typename Dual>
std::vector<HalfedgeId> loop_across(const Dual& dual, const DualTree& tree, HalfedgeId h) {
  const TreePath path = path_between(dual, tree, dual.face_of(dual.opposite(h)), dual.face_of(h));
  std::vector<HalfedgeId> loop = path.down;
  loop.push_back(h);
  loop.insert(loop.end(), path.up.begin(), path.up.end());
  return loop;
}

}  // namespace flipfree::intrinsic
