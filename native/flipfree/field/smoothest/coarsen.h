// A graph of crosses with about half as many nodes: neighbours that are tied closest are taken for
// one, whose crosses are parallel. What is topological about a smooth field is decided far above
// the size of a triangle; all faces have their say when the directions are relaxed
// (prescribed/relax.h).
#pragma once

#include <complex>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/smoothest/field_system.h"

namespace flipfree::field {

struct Coarsened {
  CrossGraph graph;
  // Per node of the finer graph: its node here, and u there = carry * u here.
  std::vector<Index> node;
  std::vector<std::complex<double>> carry;
};

// `alone`: flags of nodes that are not joined with others. E of a u that is constant on each pair
// is that of the coarser graph. Cost: O(nodes log nodes).
Coarsened coarsen(const CrossGraph& graph, const std::vector<char>& alone);

}  // namespace flipfree::field
