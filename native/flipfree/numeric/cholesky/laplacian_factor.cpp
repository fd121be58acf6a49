#include "flipfree/numeric/cholesky/laplacian_factor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/lists.h"
#include "flipfree/numeric/cholesky/symbolic_cholesky.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::numeric {
namespace {

constexpr std::size_t kCheckEvery = 1024;  // columns

}  // namespace

bool LaplacianFactor::factorize(Index vertices, const std::vector<Coupling>& couplings,
                                ExecutionContext& context) {
  const Index n = vertices - 1;
  position_ = inverse(minimum_degree({at(n), [&](const auto& add) {
                                        for (const Coupling& c : couplings) {
                                          if (c.high == n) continue;
                                          add(c.low, c.high);
                                          add(c.high, c.low);
                                        }
                                      }}));
  // Columns of the permuted strictly lower triangle, and each vertex' weight to the fixed one.
  const Lists<std::pair<Index, double>> columns(at(n), [&](const auto& add) {
    for (const Coupling& c : couplings) {
      if (c.high == n) continue;
      const auto [low, high] = std::minmax({position_[at(c.low)], position_[at(c.high)]});
      add(low, {high, c.weight});
    }
  });
  std::vector<double> excess(at(n), 0.0);
  for (const Coupling& c : couplings) {
    if (c.high == n) excess[at(position_[at(c.low)])] += c.weight;
  }

  start_.assign(1, 0);
  row_.clear();
  value_.clear();
  pivot_.assign(at(n), 0.0);
  fixed_share_.assign(at(n), 0.0);
  main_.assign(at(n), 0);
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
    if (at(j) % kCheckEvery == 0) context.check();
    pattern.clear();
    const auto add = [&](Index i, double w) {
      if (seen[at(i)] != j) {
        seen[at(i)] = j;
        sum[at(i)] = 0.0;
        pattern.push_back(i);
      }
      sum[at(i)] += w;
    };
    for (const auto& [row, weight] : columns[j]) add(row, weight);
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
    double largest = fixed_share_[at(j)] = excess[at(j)] / pivot;
    std::size_t largest_at = row_.size() + pattern.size();
    for (const Index i : pattern) {
      const double share = sum[at(i)] / pivot;
      if (share > largest) {
        largest = share;
        largest_at = row_.size();
      }
      row_.push_back(i);
      value_.push_back(share);
    }
    main_[at(j)] = largest_at;
    start_.push_back(row_.size());
    cursor[at(j)] = start_[at(j)];
    enqueue(j);
  }
  return true;
}

// The shares of a column sum to one. The largest is what the others leave of it, exactly: rounded,
// it would be a coupling to the fixed vertex that does not exist, or a force on it.
template <typename T>
void LaplacianFactor::solve(std::vector<T>& b, const ExecutionContext& context) const {
  const std::size_t n = pivot_.size();
  std::vector<T> work(n);
  for (std::size_t i = 0; i < n; ++i) work[at(position_[i])] = b[i];
  for (std::size_t j = 0; j < n; ++j) {
    if (j % kCheckEvery == 0) context.check();
    const std::size_t main = main_[j];
    T rest = work[j];
    if (main < start_[j + 1]) rest -= T(fixed_share_[j]) * work[j];
    for (std::size_t p = start_[j]; p < start_[j + 1]; ++p) {
      if (p == main) continue;
      const T part = T(value_[p]) * work[j];
      work[at(row_[p])] += part;
      rest -= part;
    }
    if (main < start_[j + 1]) work[at(row_[main])] += rest;
  }
  for (std::size_t j = n; j-- > 0;) {
    if (j % kCheckEvery == 0) context.check();
    const std::size_t main = main_[j];
    T x = work[j] / T(pivot_[j]);
    if (main == start_[j + 1]) {
      for (std::size_t p = start_[j]; p < start_[j + 1]; ++p) x += T(value_[p]) * work[at(row_[p])];
    } else {
      const T& base = work[at(row_[main])];
      x += base - T(fixed_share_[j]) * base;
      for (std::size_t p = start_[j]; p < start_[j + 1]; ++p) {
        if (p != main) x += T(value_[p]) * (work[at(row_[p])] - base);
      }
    }
    work[j] = x;
  }
  for (std::size_t i = 0; i < n; ++i) b[i] = work[at(position_[i])];
  b[n] = T(0.0);
}

template void LaplacianFactor::solve(std::vector<double>& b, const ExecutionContext& context) const;
template void LaplacianFactor::solve(std::vector<BigFloat<16>>& b,
                                     const ExecutionContext& context) const;

}  // namespace flipfree::numeric
