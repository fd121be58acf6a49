// Graphs for tests of elimination orders.
#pragma once

#include <set>
#include <utility>

#include "flipfree/numeric/cholesky/symbolic_cholesky.h"

namespace flipfree::test {

inline numeric::Graph graph_of(Index count, const std::set<std::pair<Index, Index>>& edges) {
  std::vector<std::vector<Index>> near(static_cast<std::size_t>(count));
  for (const auto& [a, b] : edges) {
    near[static_cast<std::size_t>(a)].push_back(b);
    near[static_cast<std::size_t>(b)].push_back(a);
  }
  numeric::Graph graph;
  graph.offset.push_back(0);
  for (const auto& list : near) {
    graph.neighbour.insert(graph.neighbour.end(), list.begin(), list.end());
    graph.offset.push_back(static_cast<Index>(graph.neighbour.size()));
  }
  return graph;
}

// A triangulated lattice.
inline numeric::Graph lattice(Index columns, Index rows) {
  std::set<std::pair<Index, Index>> edges;
  for (Index y = 0; y < rows; ++y) {
    for (Index x = 0; x < columns; ++x) {
      const Index v = y * columns + x;
      if (x + 1 < columns) edges.emplace(v, v + 1);
      if (y + 1 < rows) edges.emplace(v, v + columns);
      if (x + 1 < columns && y + 1 < rows) edges.emplace(v, v + columns + 1);
    }
  }
  return graph_of(columns * rows, edges);
}

}  // namespace flipfree::test
