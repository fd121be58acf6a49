// Sparse systems for tests of the multifrontal factorization, below its door (cholesky.h).
#pragma once

#include <Eigen/SparseCore>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/numeric/cholesky/multifrontal.h"
#include "flipfree/numeric/nested_dissection.h"

namespace flipfree::test {

using numeric::FactorMemory;
using numeric::Graph;
using numeric::Multifrontal;
using numeric::SparseMatrix;

using Triplets = std::vector<Eigen::Triplet<double, Index>>;

struct System {
  SparseMatrix matrix;  // lower triangle
  Graph graph;
  Index block = 1;
};

// Diagonally dominant, coupled as the graph says, `block` unknowns a vertex.
inline System random_system(const Graph& graph, Index block, std::mt19937& random) {
  std::uniform_real_distribution<double> weight(-1.0, 1.0);
  const Index n = block * graph.count();
  Triplets entries;
  std::vector<double> sum(static_cast<std::size_t>(n), 0.1);
  const auto couple = [&](Index i, Index j) {
    const double w = weight(random);
    entries.emplace_back(i, j, w);
    sum[static_cast<std::size_t>(i)] += std::abs(w);
    sum[static_cast<std::size_t>(j)] += std::abs(w);
  };
  for (Index v = 0; v < graph.count(); ++v) {
    for (Index k = 0; k < block; ++k) {
      for (Index l = 0; l < k; ++l) couple(block * v + k, block * v + l);
    }
    for_neighbours(graph, v, [&](Index u) {
      if (u > v) return;
      for (Index k = 0; k < block; ++k) {
        for (Index l = 0; l < block; ++l) couple(block * v + k, block * u + l);
      }
    });
  }
  for (Index i = 0; i < n; ++i) entries.emplace_back(i, i, sum[static_cast<std::size_t>(i)]);
  System system;
  system.matrix.resize(n, n);
  system.matrix.setFromTriplets(entries.begin(), entries.end());
  system.graph = graph;
  system.block = block;
  return system;
}

inline Multifrontal plan(const System& system, FactorMemory memory = {}) {
  const ExecutionContext context;
  return Multifrontal(
      analyze_supernodes(system.graph, nested_dissection(system.graph, nullptr, context), context),
      system.block, static_cast<Index>(system.matrix.rows()), system.matrix.outerIndexPtr(),
      system.matrix.innerIndexPtr(), context, std::move(memory));
}

}  // namespace flipfree::test
