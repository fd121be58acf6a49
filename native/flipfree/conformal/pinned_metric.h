// The conformal metric with scale factor fixed (u = 0) at some vertices and prescribed angles at
// all others: free boundaries, and cones whose angle follows from the surface (thesis 4.2.1: the
// energy restricted to a subspace of u is convex as well; Springborn, Schröder, Pinkall 2008,
// section 6: u = 0 on the boundary distorts least).
//
// Uses the same engine and the same energy-free line search as the metric of prescribed angles, in
// double: its result are target angles, which the full solver then meets to any accuracy.
#pragma once

#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::conformal {

struct PinnedMetric {
  std::vector<double> u;  // #V: logarithmic scale factors, 0 where pinned
  std::vector<double>
      angles;          // #V: total angles reached; at vertices that are not pinned the targets
  double error = 0.0;  // largest angle error at vertices that are not pinned
  int iterations = 0;
  bool converged = false;
};

// The cotan Laplacian of an evaluated gradient without its pinned rows and columns.
class PinnedLaplacian {
 public:
  PinnedLaplacian(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                  const std::vector<char>& pinned, ExecutionContext& context);
  // False if the matrix is not positive definite to working precision (a component without pins,
  // degenerate triangles); solve() must not be called then.
  bool valid() const { return valid_; }
  // Solves L x = b over all vertices; entries of pinned vertices are ignored in b and zero in x.
  std::vector<double> solve(const std::vector<double>& b, ExecutionContext& context) const;

 private:
  std::vector<Index> row_;  // per vertex, kInvalid = pinned
  Index rows_ = 0;
  bool valid_ = true;
  numeric::SparseCholesky cholesky_;
};

// `target`: #V, read where pinned[v] = 0. Preconditions: valid connected surface, at least one pin.
// Does not throw for lack of convergence (targets that no metric meets): says so in the result.
// Cost: as the metric in double.
PinnedMetric compute_pinned_metric(const mesh::Surface& surface, const std::vector<double>& target,
                                   const std::vector<char>& pinned, double tolerance,
                                   ExecutionContext& context);

}  // namespace flipfree::conformal
