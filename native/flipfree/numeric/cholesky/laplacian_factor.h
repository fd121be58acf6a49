// Factorization of a weighted graph Laplacian without any subtraction, hence accurate entry by
// entry.
//
// A Laplacian with non-negative weights, one vertex fixed, is a diagonally dominant M-matrix.
// Eliminating a vertex adds to the weights between its neighbours; if pivots are formed as sums of
// weights instead of updated diagonals (Grassmann, Taksar, Heyman 1985; Alfa, Xue, Ye 2002), every
// entry of the factor has a small relative error however far the weights are apart. A Cholesky
// factorization of the assembled matrix loses the small weights against the large ones instead.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::numeric {

// An edge of the graph, low < high, weight >= 0.
struct Coupling {
  Index low = 0;
  Index high = 0;
  double weight = 0.0;
};

class LaplacianFactor {
 public:
  // Factorizes the Laplacian of `vertices` vertices with the last one fixed at 0; couplings are
  // distinct pairs sorted by (low, high). False if some vertex is not connected to the fixed one.
  // Serial; cost of a simplicial Cholesky.
  [[nodiscard]] bool factorize(Index vertices, const std::vector<Coupling>& couplings,
                               ExecutionContext& context);

  // Solves L x = b in place; b has one entry per vertex, the last one is ignored and becomes 0.
  // T: double or BigFloat<16>. A heavy coupling's ends differ by less than a double of them shows:
  // numbers of more bits keep such differences, with the relative accuracy of the factor.
  template <typename T>
  void solve(std::vector<T>& b, const ExecutionContext& context) const;

 private:
  std::vector<Index>
      position_;  // vertex -> place in the elimination order (approximate minimum degree)
  std::vector<std::size_t> start_;  // columns of the factor: strictly lower part, magnitudes
  std::vector<Index> row_;
  std::vector<double> value_;
  std::vector<double> pivot_;
  std::vector<double> fixed_share_;  // of each pivot: the weight to the fixed vertex
  std::vector<std::size_t> main_;    // the largest entry of each column, or the next column's start
                                     // if the fixed share is larger
};

}  // namespace flipfree::numeric
