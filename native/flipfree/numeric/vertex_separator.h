// Splits a graph in two by few vertices: one step of a nested dissection (nested_dissection.h,
// where the method and its sources are).
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/numeric/graph.h"

namespace flipfree::numeric {

struct Subgraph : Graph {
  // Ranks of the coordinates in the whole graph; empty without a drawing.
  std::vector<std::array<Index, 2>> rank;
  bool ends_first = false;  // is vertex 0 at an end?
};

enum Side : char { kLeft = 0, kRight = 1, kSeparator = 2 };

// The side of every vertex; no edge joins left and right. A graph that is not connected is split
// into its components, without a separator. `sorted` gets the vertices from one end to the other,
// or stays empty: so numbered, the vertices of a side have their neighbours near them, and the
// first one is at an end. Precondition: two vertices or more. Cost: some sweeps over the edges.
// Checks for cancel.
std::vector<char> separate(const Subgraph& part, std::vector<Index>& sorted,
                           const ExecutionContext& context);

}  // namespace flipfree::numeric
