#include "flipfree/embedding/convex_combination.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/numeric/nested_dissection.h"

namespace flipfree {
namespace {

using Size = std::size_t;

// position[i]: when unknown i is eliminated.
std::vector<Index> elimination_order(const ConvexCombinations& system,
                                     const ExecutionContext& context) {
  const Graph graph{system.start, system.column};
  const std::vector<Index> order = nested_dissection(graph, nullptr, context);
  std::vector<Index> position(order.size());
  for (Size k = 0; k < order.size(); ++k)
    position[static_cast<Size>(order[k])] = static_cast<Index>(k);
  return position;
}

}  // namespace

Points2 solve_convex_combinations(const ConvexCombinations& system, ExecutionContext& context) {
  const Index n = static_cast<Index>(system.start.size()) - 1;
  if (n == 0) return Points2(0, 2);
  const std::vector<Index> position = elimination_order(system, context);
  std::vector<Index> unknown(static_cast<Size>(n));
  for (Index i = 0; i < n; ++i) unknown[static_cast<Size>(position[static_cast<Size>(i)])] = i;

  // Elimination tree of the permuted pattern (Liu 1990): parent of k = first later node that its
  // elimination couples.
  std::vector<Index> parent(static_cast<Size>(n), kInvalid);
  std::vector<Index> ancestor(static_cast<Size>(n), kInvalid);
  for (Index k = 0; k < n; ++k) {
    const Size u = static_cast<Size>(unknown[static_cast<Size>(k)]);
    for (Index e = system.start[u]; e < system.start[u + 1]; ++e) {
      Index j = position[static_cast<Size>(system.column[static_cast<Size>(e)])];
      while (j != kInvalid && j < k) {
        const Index next = ancestor[static_cast<Size>(j)];
        ancestor[static_cast<Size>(j)] = k;
        if (next == kInvalid) parent[static_cast<Size>(j)] = k;
        j = next;
      }
    }
  }

  // Row by row: first the weights that lead back to eliminated nodes are passed on along those
  // nodes' own rows, then what remains is normalised. Row k of the result: node k = sum over later
  // nodes + fixed part.
  std::vector<std::size_t> row_start(static_cast<Size>(n) + 1, 0);
  std::vector<Index> row_column;
  std::vector<double> row_weight;
  Points2 result(n, 2);  // fixed part first, solution after back substitution
  std::vector<double> row_fixed(static_cast<Size>(n));
  std::vector<double> work(static_cast<Size>(n), 0.0);
  std::vector<Index> mark(static_cast<Size>(n), kInvalid);
  std::vector<Index> back;
  std::vector<Index> ahead;
  std::vector<Index> path;
  std::size_t operations = 0;
  for (Index k = 0; k < n; ++k) {
    const Size u = static_cast<Size>(unknown[static_cast<Size>(k)]);
    back.clear();
    ahead.clear();
    mark[static_cast<Size>(k)] = k;
    double fixed = system.fixed_weight[u];
    Vector2 sum = system.fixed_sum.row(static_cast<Index>(u));
    for (Index e = system.start[u]; e < system.start[u + 1]; ++e) {
      const Index j = position[static_cast<Size>(system.column[static_cast<Size>(e)])];
      work[static_cast<Size>(j)] += system.weight[static_cast<Size>(e)];
      if (j > k) {
        if (mark[static_cast<Size>(j)] != k) ahead.push_back(j);
        mark[static_cast<Size>(j)] = k;
        continue;
      }
      for (Index t = j; t != kInvalid && t < k && mark[static_cast<Size>(t)] != k;
           t = parent[static_cast<Size>(t)]) {
        mark[static_cast<Size>(t)] = k;
        back.push_back(t);
      }
    }
    std::sort(back.begin(), back.end());  // a node's row couples later nodes only: increasing order
                                          // is elimination order
    for (const Index j : back) {
      const double factor = work[static_cast<Size>(j)];
      work[static_cast<Size>(j)] = 0.0;
      if (factor == 0.0) continue;
      for (std::size_t e = row_start[static_cast<Size>(j)]; e < row_start[static_cast<Size>(j) + 1];
           ++e) {
        const Index i = row_column[e];
        work[static_cast<Size>(i)] += factor * row_weight[e];
        if (i > k && mark[static_cast<Size>(i)] != k) {
          mark[static_cast<Size>(i)] = k;
          ahead.push_back(i);
        }
      }
      operations += row_start[static_cast<Size>(j) + 1] - row_start[static_cast<Size>(j)];
      fixed += factor * row_fixed[static_cast<Size>(j)];
      sum += factor * result.row(j).transpose();
    }
    work[static_cast<Size>(k)] = 0.0;  // walks that return to k only scale the rest
    double total = fixed;
    for (const Index i : ahead) total += work[static_cast<Size>(i)];
    if (!(total > 0.0) || !std::isfinite(total)) {
      throw_not_converged(ErrorCode::kFactorizationFailed,
                          "Elimination of vertex " + std::to_string(u) +
                              " met a weight that is zero or overflowed.",
                          ElementKind::kVertex, {static_cast<Index>(u)});
    }
    for (const Index i : ahead) {
      row_column.push_back(i);
      row_weight.push_back(work[static_cast<Size>(i)] / total);
      work[static_cast<Size>(i)] = 0.0;
    }
    row_start[static_cast<Size>(k) + 1] = row_column.size();
    row_fixed[static_cast<Size>(k)] = fixed / total;
    result.row(k) = sum.transpose() / total;
    if (operations > 20'000'000) {
      operations = 0;
      context.check();
    }
  }
  for (Index k = n; k-- > 0;) {
    Vector2 sum = result.row(k);
    for (std::size_t e = row_start[static_cast<Size>(k)]; e < row_start[static_cast<Size>(k) + 1];
         ++e) {
      sum += row_weight[e] * result.row(row_column[e]).transpose();
    }
    result.row(k) = sum.transpose();
  }
  Points2 points(n, 2);
  for (Index i = 0; i < n; ++i) points.row(i) = result.row(position[static_cast<Size>(i)]);
  return points;
}

}  // namespace flipfree
