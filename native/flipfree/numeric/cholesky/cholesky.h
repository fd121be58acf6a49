// Sparse Cholesky factorization that keeps its symbolic analysis. Symmetric positive definite
// matrices only.
//
// Nested dissection, supernodes, multifrontal numeric phase: nested_dissection.h,
// symbolic_cholesky.h, multifrontal.h. Of our own, because no library call can be cancelled within
// its largest front or ordering, and because the bits must not depend on the number of threads.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <limits>
#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/numeric/nested_dissection.h"

namespace flipfree::numeric {

// The elimination order of one graph as a start for the next: for meshes that are solved again and
// again while vertices come, go, are held or let go.
//
// What is remembered is the node of the dissection tree (dissection_tree.h) of every vertex, by a
// label that outlives the graph. Vertices that are not known are put where their neighbours are;
// then the order is repaired. A new order is searched when less than half is known, or when a
// repaired one has become dear.

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

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

class SparseCholesky {
 public:
  SparseCholesky();
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  // Orders and analyses the pattern of `matrix`, n x n, of which the lower triangle is read;
  // compressed, sorted columns. The pattern is kept until the next call. Pairs of unknowns (2 i, 2
  // i + 1) that always occur together are found and handled as one.
  void analyze(const SparseMatrix& matrix, ExecutionContext& context);
  // As analyze(), from the order that `memory` has of a graph with nearly the same vertices, and
  // puts this one there. Vertex v of the graph (an unknown, or a pair) has the label label[v],
  // ascending; without pairs where labels are of pairs, the memory is left alone.
  void analyze(const SparseMatrix& matrix, ExecutionContext& context, EliminationMemory& memory,
               const std::vector<Index>& label);

  // Numeric factorization of a matrix with exactly the analysed pattern. False if it is not
  // positive definite to working precision (the factor is then unusable until the next success).
  // Same bits for any number of threads. Reports progress over the context's current range.
  [[nodiscard]] bool factorize(const SparseMatrix& matrix, ExecutionContext& context);

  // Solves A X = B; B is n x k. Requires a successful factorize().
  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                        ExecutionContext& context) const;

  // Nonzeros of the factor predicted by the analysis, and the flops of one factorization.
  std::int64_t factor_nonzeros() const;
  double factor_flops() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace flipfree::numeric
