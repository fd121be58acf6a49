// Solves "every unknown point is the given convex combination of its neighbours" without any
// subtraction.
//
// The matrix is a weighted graph with absorbing (fixed) nodes: a weakly diagonally dominant
// M-matrix that need not be symmetric. Eliminating a node redistributes its weight to its
// neighbours, and the pivot is formed as a *sum* of the remaining positive weights (Grassmann,
// Taksar, Heyman 1985), so that every barycentric weight comes out with small relative error
// however extreme the input weights are. A Cholesky or LU solve of the same system cancels in its
// diagonal and loses the small weights, which is one of the ways in which Tutte maps fold over.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::embedding {

// Row-compressed positive weights: unknown i is the average of `column[k]` with weight `weight[k]`,
// k in [start[i], start[i + 1]), and of fixed points with total weight fixed_weight[i] and weighted
// sum fixed_sum.row(i). The pattern must be structurally symmetric; every unknown must be connected
// to a fixed point.
struct ConvexCombinations {
  std::vector<Index> start;   // #unknowns + 1
  std::vector<Index> column;  // neighbour unknowns
  std::vector<double> weight;
  std::vector<double> fixed_weight;
  Points2 fixed_sum;
};

// Positions of the unknowns. Cost: a sparse LU factorization under a minimum degree ordering.
// Throws NotConverged (kFactorizationFailed) if a weight overflowed or an unknown has no path to a
// fixed point.
Points2 solve_convex_combinations(const ConvexCombinations& system, ExecutionContext& context);

}  // namespace flipfree::embedding
