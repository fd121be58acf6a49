#include "flipfree/numeric/laplacian_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

namespace flipfree {
namespace {

constexpr std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void LaplacianFactor::order(Index vertices, const std::vector<Coupling>& couplings) {
  const Index n = vertices - 1;
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(2 * couplings.size() + at(n));
  for (Index i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
  for (const Coupling& c : couplings) {
    if (c.high == n) continue;
    entries.emplace_back(c.low, c.high, 1.0);
    entries.emplace_back(c.high, c.low, 1.0);
  }
  Eigen::SparseMatrix<double, Eigen::ColMajor, Index> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> permutation;
  Eigen::AMDOrdering<Index>()(pattern, permutation);
  // AMD lists the vertices in elimination order.
  position_.assign(at(n), 0);
  for (Index i = 0; i < n; ++i) position_[at(permutation.indices()[i])] = i;
}

bool LaplacianFactor::factorize(Index vertices, const std::vector<Coupling>& couplings,
                                ExecutionContext& context) {
  const Index n = vertices - 1;
  order(vertices, couplings);
  // Columns of the permuted strictly lower triangle, and each vertex' weight to the fixed one.
  std::vector<double> excess(at(n), 0.0);
  std::vector<std::size_t> column(at(n) + 1, 0);
  const auto ends = [&](const Coupling& c) {
    const Index a = position_[at(c.low)];
    const Index b = position_[at(c.high)];
    return std::pair(std::min(a, b), std::max(a, b));
  };
  for (const Coupling& c : couplings) {
    if (c.high == n) {
      excess[at(position_[at(c.low)])] += c.weight;
    } else {
      ++column[at(ends(c).first) + 1];
    }
  }
  for (std::size_t i = 0; i < at(n); ++i) column[i + 1] += column[i];
  std::vector<std::pair<Index, double>> entry(column[at(n)]);
  std::vector<std::size_t> fill(column.begin(), column.end() - 1);
  for (const Coupling& c : couplings) {
    if (c.high != n) entry[fill[at(ends(c).first)]++] = {ends(c).second, c.weight};
  }

  start_.assign(1, 0);
  row_.clear();
  value_.clear();
  pivot_.assign(at(n), 0.0);
  std::vector<double> sum(at(n), 0.0);
  std::vector<Index> seen(at(n), kInvalid);
  std::vector<Index> pattern;
  // Columns waiting to update column j: a linked list per row, each column in the list of its next
  // row.
  std::vector<Index> first(at(n), kInvalid);
  std::vector<Index> next(at(n), kInvalid);
  std::vector<std::size_t> cursor(at(n), 0);
  const auto enqueue = [&](Index k) {
    if (cursor[at(k)] == start_[at(k) + 1]) return;
    const Index r = row_[cursor[at(k)]];
    next[at(k)] = first[at(r)];
    first[at(r)] = k;
  };
  for (Index j = 0; j < n; ++j) {
    if (j % 1024 == 0) context.check();
    pattern.clear();
    const auto add = [&](Index i, double w) {
      if (seen[at(i)] != j) {
        seen[at(i)] = j;
        sum[at(i)] = 0.0;
        pattern.push_back(i);
      }
      sum[at(i)] += w;
    };
    for (std::size_t p = column[at(j)]; p < column[at(j) + 1]; ++p)
      add(entry[p].first, entry[p].second);
    for (Index k = first[at(j)]; k != kInvalid;) {
      const Index following = next[at(k)];
      const std::size_t p = cursor[at(k)]++;
      const double factor = value_[p] * pivot_[at(k)];
      excess[at(j)] += value_[p] * excess[at(k)];
      for (std::size_t q = p + 1; q < start_[at(k) + 1]; ++q) add(row_[q], value_[q] * factor);
      enqueue(k);
      k = following;
    }
    std::sort(pattern.begin(), pattern.end());
    double pivot = excess[at(j)];
    for (const Index i : pattern) pivot += sum[at(i)];
    if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
    pivot_[at(j)] = pivot;
    for (const Index i : pattern) {
      row_.push_back(i);
      value_.push_back(sum[at(i)] / pivot);
    }
    start_.push_back(row_.size());
    cursor[at(j)] = start_[at(j)];
    enqueue(j);
  }
  work_.resize(at(n));
  return true;
}

void LaplacianFactor::solve(std::vector<double>& b) const {
  const std::size_t n = pivot_.size();
  for (std::size_t i = 0; i < n; ++i) work_[at(position_[i])] = b[i];
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t p = start_[j]; p < start_[j + 1]; ++p)
      work_[at(row_[p])] += value_[p] * work_[j];
  }
  for (std::size_t j = n; j-- > 0;) {
    double x = work_[j] / pivot_[j];
    for (std::size_t p = start_[j]; p < start_[j + 1]; ++p) x += value_[p] * work_[at(row_[p])];
    work_[j] = x;
  }
  for (std::size_t i = 0; i < n; ++i) b[i] = work_[at(position_[i])];
  b[n] = 0.0;
}

}  // namespace flipfree
