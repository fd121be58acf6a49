#include "flipfree/embedding/tutte/convex_combination.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/numeric/nested_dissection.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// position[i]: when unknown i is eliminated.
std::vector<Index> elimination_order(const ConvexCombinations& system,
                                     const ExecutionContext& context) {
  const numeric::Graph graph{system.start, system.column};
  const std::vector<Index> order = numeric::nested_dissection(graph, nullptr, context);
  std::vector<Index> position(order.size());
  for (Size k = 0; k < order.size(); ++k)
    position[static_cast<Size>(order[k])] = static_cast<Index>(k);
  return position;
}

// Elimination tree of the permuted pattern (Liu 1990): parent of k = first later node that its
// elimination couples.
std::vector<Index> elimination_tree(const ConvexCombinations& system,
                                    const std::vector<Index>& position,
                                    const std::vector<Index>& unknown) {
  const auto n = static_cast<Index>(unknown.size());
  std::vector<Index> parent(unknown.size(), kInvalid);
  std::vector<Index> ancestor(unknown.size(), kInvalid);
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
  return parent;
}

// Row by row: first the weights that lead back to eliminated nodes are passed on along those nodes'
// own rows, then what remains is normalised. Row k of the result: node k = sum over later nodes +
// fixed part.
class Elimination {
 public:
  Elimination(const ConvexCombinations& system, const ExecutionContext& context)
      : system_(system), position_(elimination_order(system, context)), unknown_(position_.size()) {
    for (Size i = 0; i < position_.size(); ++i)
      unknown_[static_cast<Size>(position_[i])] = static_cast<Index>(i);
    parent_ = elimination_tree(system, position_, unknown_);
    row_start_.assign(unknown_.size() + 1, 0);
    row_fixed_.resize(unknown_.size());
    result_.resize(size(), 2);
    work_.assign(unknown_.size(), 0.0);
    mark_.assign(unknown_.size(), kInvalid);
  }

  Points2 solve(const ExecutionContext& context) {
    for (Index k = 0; k < size(); ++k) {
      scatter(k);
      pass_on(k);
      normalise(k);
      if (operations_ > kOperationsPerCheck) {
        operations_ = 0;
        context.check();
      }
    }
    return substitute_back();
  }

 private:
  static constexpr std::size_t kOperationsPerCheck = 20'000'000;

  Index size() const { return static_cast<Index>(unknown_.size()); }

  // The weights of node k: `work_` at the nodes ahead, and at those behind to be passed on.
  void scatter(Index k) {
    const Size u = static_cast<Size>(unknown_[static_cast<Size>(k)]);
    back_.clear();
    ahead_.clear();
    mark_[static_cast<Size>(k)] = k;
    fixed_ = system_.fixed_weight[u];
    sum_ = system_.fixed_sum.row(static_cast<Index>(u));
    for (Index e = system_.start[u]; e < system_.start[u + 1]; ++e) {
      const Index j = position_[static_cast<Size>(system_.column[static_cast<Size>(e)])];
      work_[static_cast<Size>(j)] += system_.weight[static_cast<Size>(e)];
      if (j > k) {
        if (mark_[static_cast<Size>(j)] != k) ahead_.push_back(j);
        mark_[static_cast<Size>(j)] = k;
        continue;
      }
      for (Index t = j; t != kInvalid && t < k && mark_[static_cast<Size>(t)] != k;
           t = parent_[static_cast<Size>(t)]) {
        mark_[static_cast<Size>(t)] = k;
        back_.push_back(t);
      }
    }
    // A node's row couples later nodes only: increasing order is elimination order.
    std::sort(back_.begin(), back_.end());
  }

  void pass_on(Index k) {
    for (const Index j : back_) {
      const double factor = work_[static_cast<Size>(j)];
      work_[static_cast<Size>(j)] = 0.0;
      if (factor == 0.0) continue;
      const std::size_t end = row_start_[static_cast<Size>(j) + 1];
      for (std::size_t e = row_start_[static_cast<Size>(j)]; e < end; ++e) {
        const Index i = row_column_[e];
        work_[static_cast<Size>(i)] += factor * row_weight_[e];
        if (i > k && mark_[static_cast<Size>(i)] != k) {
          mark_[static_cast<Size>(i)] = k;
          ahead_.push_back(i);
        }
      }
      operations_ += end - row_start_[static_cast<Size>(j)];
      fixed_ += factor * row_fixed_[static_cast<Size>(j)];
      sum_ += factor * result_.row(j).transpose();
    }
    work_[static_cast<Size>(k)] = 0.0;  // walks that return to k only scale the rest
  }

  void normalise(Index k) {
    double total = fixed_;
    for (const Index i : ahead_) total += work_[static_cast<Size>(i)];
    if (!(total > 0.0) || !std::isfinite(total)) {
      const Index u = unknown_[static_cast<Size>(k)];
      throw_not_converged(
          ErrorCode::kFactorizationFailed,
          "Elimination of vertex " + vertex_id(u) + " met a weight that is zero or overflowed.",
          ElementKind::kVertex, {u});
    }
    for (const Index i : ahead_) {
      row_column_.push_back(i);
      row_weight_.push_back(work_[static_cast<Size>(i)] / total);
      work_[static_cast<Size>(i)] = 0.0;
    }
    row_start_[static_cast<Size>(k) + 1] = row_column_.size();
    row_fixed_[static_cast<Size>(k)] = fixed_ / total;
    result_.row(k) = sum_.transpose() / total;
  }

  Points2 substitute_back() {
    for (Index k = size(); k-- > 0;) {
      Vector2 sum = result_.row(k);
      const std::size_t end = row_start_[static_cast<Size>(k) + 1];
      for (std::size_t e = row_start_[static_cast<Size>(k)]; e < end; ++e)
        sum += row_weight_[e] * result_.row(row_column_[e]).transpose();
      result_.row(k) = sum.transpose();
    }
    Points2 points(size(), 2);
    for (Index i = 0; i < size(); ++i) points.row(i) = result_.row(position_[static_cast<Size>(i)]);
    return points;
  }

  const ConvexCombinations& system_;
  std::vector<Index> position_;  // of each unknown in the order of elimination
  std::vector<Index> unknown_;   // its inverse
  std::vector<Index> parent_;
  // Rows of the result, in order of elimination.
  std::vector<std::size_t> row_start_;
  std::vector<Index> row_column_;
  std::vector<double> row_weight_;
  std::vector<double> row_fixed_;
  Points2 result_;  // fixed part first, solution after back substitution
  // The row in work.
  std::vector<double> work_;
  std::vector<Index> mark_;
  std::vector<Index> back_;
  std::vector<Index> ahead_;
  double fixed_ = 0.0;
  Vector2 sum_ = Vector2::Zero();
  std::size_t operations_ = 0;
};

}  // namespace

Points2 solve_convex_combinations(const ConvexCombinations& system, ExecutionContext& context) {
  if (system.start.size() <= 1) return Points2(0, 2);
  return Elimination(system, context).solve(context);
}

}  // namespace flipfree::embedding
