// Symbolic analysis of a sparse Cholesky factorization: an order that fills little, elimination
// tree, supernodes and their row structures.
//
// Based on: Liu 1990, "The role of elimination trees in sparse factorization"; Ashcraft, Grimes
// 1989 (relaxed supernodes).
//
//   supernode s = columns [first[s], first[s + 1]) with one common row structure:
//
//      first  +---+            front of s: its columns and then its rows below,
//             |\  |            both ascending; rows_begin[s] .. rows_begin[s + 1) index `rows`
//             +---+
//      rows   |   |            parent of s: the supernode that has rows[rows_begin[s]] as a column
//             +---+
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/lists.h"

namespace flipfree::numeric {

// Symmetric graph without loops: the neighbours of every vertex.
using Graph = Lists<Index>;

// An order that fills little: elimination position -> vertex. Approximate minimum degree (Amestoy,
// Davis, Duff 1996), by Eigen, which cannot be cancelled: 0.3 s of 320 000 vertices.
std::vector<Index> minimum_degree(const Graph& graph);
std::vector<Index> inverse(const std::vector<Index>& order);

struct Supernodes {
  std::vector<Index> order;     // column of the factor -> vertex of the graph (postordered)
  std::vector<Index> position;  // its inverse
  std::vector<Index> first;     // count + 1
  std::vector<std::int64_t> rows_begin;  // count + 1
  std::vector<Index> rows;
  std::vector<Index> relative;   // beside rows: place of that row in the front of the parent
  std::vector<Index> parent;     // kInvalid for roots; otherwise greater than the supernode itself
  Lists<Index> children;         // of each supernode, ascending; behind them the roots
  std::vector<Index> of_column;  // column -> supernode

  Index count() const { return static_cast<Index>(first.size()) - 1; }
  Index columns(Index s) const { return first[at(s) + 1] - first[at(s)]; }
  Index rows_below(Index s) const {
    return static_cast<Index>(rows_begin[at(s) + 1] - rows_begin[at(s)]);
  }
};

// Ordered by minimum degree. Cost: nearly linear in the graph, and O(entries of the factor).
Supernodes analyze_supernodes(const Graph& graph, const ExecutionContext& context);

}  // namespace flipfree::numeric
