#include "flipfree/numeric/cholesky/elimination_memory.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "flipfree/numeric/ordering/nested_dissection.h"

namespace flipfree::numeric {
namespace {

// A repaired order may cost so many times what a planar graph of its size is expected to.
constexpr double kDear = 1.5;

}  // namespace

bool EliminationMemory::recall(const Graph& graph, const std::vector<Index>& label,
                               std::vector<Index>& before, DissectionTree& tree) const {
  const Index count = graph.count();
  std::vector<Index> rank(at(count), kInvalid);
  Index known = 0;
  tree.assign(at(count), TreeNode());
  for (Index v = 0; v < count; ++v) {
    const std::size_t l = at(label[at(v)]);
    if (l >= rank_.size() || rank_[l] == kInvalid) continue;
    rank[at(v)] = rank_[l];
    tree[at(v)] = node_[l];
    ++known;
  }
  if (2 * known < count || count == 0) return false;
  // Breadth-first from what is known; `queue` has vertices that are placed, `rank` says which.
  const Index last = static_cast<Index>(rank_.size());  // behind all ranks
  std::vector<Index> queue;
  const auto for_neighbours = [&](Index v, auto visit) {
    for (Index i = graph.offset[at(v)]; i < graph.offset[at(v) + 1]; ++i)
      visit(graph.neighbour[at(i)]);
  };
  const auto place = [&](Index v) {
    if (rank[at(v)] != kInvalid) return;
    bool found = false;
    TreeNode deepest;
    for_neighbours(v, [&](Index u) {
      if (rank[at(u)] == kInvalid) return;
      if (!found || tree[at(u)].depth() > deepest.depth()) deepest = tree[at(u)];
      found = true;
    });
    if (!found) return;
    tree[at(v)] = deepest;
    rank[at(v)] = last + v;
    queue.push_back(v);
  };
  for (Index v = 0; v < count; ++v) place(v);
  for (std::size_t head = 0; head < queue.size(); ++head)
    for_neighbours(queue[head], [&](Index u) { place(u); });
  for (Index v = 0; v < count; ++v) {
    if (rank[at(v)] == kInvalid) rank[at(v)] = last + v;  // a component of its own
  }
  before.resize(at(count));
  std::iota(before.begin(), before.end(), Index{0});
  std::sort(before.begin(), before.end(),
            [&](Index a, Index b) { return rank[at(a)] < rank[at(b)]; });
  return true;
}

void EliminationMemory::keep(const std::vector<Index>& order, const DissectionTree& tree,
                             const std::vector<Index>& label, double flops, bool anew) {
  const Index most = label.empty() ? 0 : std::min(stable_, label.back() + 1);
  if (anew) {
    rank_.assign(at(most), kInvalid);
    node_.assign(at(most), TreeNode());
    flops_ = flops;
    count_ = static_cast<Index>(order.size());
  } else if (at(most) > rank_.size()) {
    rank_.resize(at(most), kInvalid);
    node_.resize(at(most), TreeNode());
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Index l = label[at(order[i])];
    if (l >= most) continue;
    rank_[at(l)] = static_cast<Index>(i);
    node_[at(l)] = tree[at(order[i])];
  }
}

bool EliminationMemory::dear(Index count, double flops) const {
  const double growth = static_cast<double>(count) / std::max<double>(1.0, count_);
  return flops > kDear * flops_ * std::pow(growth, 1.5);
}

}  // namespace flipfree::numeric
