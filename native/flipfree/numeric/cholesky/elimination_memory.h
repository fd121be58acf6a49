// The elimination order of one graph as a start for the next: for meshes that are solved again and
// again while vertices come, go, are held or let go.
//
// What is remembered is the node of the dissection tree (dissection_tree.h) of every vertex, by a
// label that outlives the graph. Vertices that are not known are put where their neighbours are;
// then the order is repaired. A new order is searched when less than half is known, or when a
// repaired one has become dear.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/numeric/ordering/dissection_tree.h"

namespace flipfree::numeric {

class EliminationMemory {
 public:
  // Labels from `stable` on may mean another vertex the next time: they are not remembered.
  explicit EliminationMemory(Index stable = std::numeric_limits<Index>::max()) : stable_(stable) {}

  // For a graph whose vertex v has the label label[v] (ascending): a tree that is nearly one of it,
  // and the order to repair_dissection(). False if too little is known.
  bool recall(const Graph& graph, const std::vector<Index>& label, std::vector<Index>& before,
              DissectionTree& tree) const;
  // order: elimination position -> vertex. `flops`: cost of the factorization; `anew`: the order
  // was searched, not repaired.
  void keep(const std::vector<Index>& order, const DissectionTree& tree,
            const std::vector<Index>& label, double flops, bool anew);
  // Is a repaired order of so many vertices and flops worse than what a new one is expected to be?
  bool dear(Index count, double flops) const;

 private:
  Index stable_;
  std::vector<Index> rank_;     // by label: place in the last order that had it; kInvalid = unknown
  std::vector<TreeNode> node_;  // by label
  double flops_ = 0;            // of the last order that was searched
  Index count_ = 0;             // and its vertices
};

}  // namespace flipfree::numeric
