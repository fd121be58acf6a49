#include "flipfree/conformal/newton_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "flipfree/base/lists.h"

namespace flipfree::conformal {

namespace {

constexpr int kRefinementRounds = 3;  // of refinement, Cholesky
constexpr double kNegligible = 1e-6;  // of the gradient: what dropping low parts may change
constexpr int kAccurateRounds = 8;    // with the accurate factorization
constexpr int kLeastBits = 256;       // of its direction
void add(FineVector& d, std::size_t i, double x) {
  const double sum = d.high[i] + x;
  const double part = sum - d.high[i];
  d.low[i] += (d.high[i] - (sum - part)) + (x - part);
  d.high[i] = sum;
}

// A gradient sums to zero; what rounding adds would all land on the fixed unknown.
std::vector<double> without_mean(std::vector<double> g) {
  double mean = 0.0;
  for (const double x : g) mean += x / static_cast<double>(g.size());
  for (double& x : g) x -= mean;
  return g;
}

void clear(FineVector& d, std::size_t n) {
  d.high.assign(n, 0.0);
  d.low.assign(n, 0.0);
  d.full.clear();
}

// d_j - d_i, from two doubles or from all bits.
double difference_along(const numeric::Coupling& c, const FineVector& d) {
  const std::size_t i = at(c.low), j = at(c.high);
  return d.full.empty() ? (d.high[j] - d.high[i]) + (d.low[j] - d.low[i])
                        : (d.full[j] - d.full[i]).to_double();
}

// Infinite if an entry of the range is not a number: comparisons with it would pass it by.
template <typename Iterator>
double largest_of(Iterator begin, Iterator end) {
  double largest = 0.0;
  for (; begin != end; ++begin) {
    const double size = std::abs(*begin);
    largest = std::isnan(size) ? std::numeric_limits<double>::infinity() : std::max(largest, size);
  }
  return largest;
}

}  // namespace

NewtonSystem::NewtonSystem(const std::vector<char>& pinned) : row_(pinned.size()) {
  for (std::size_t v = 0; v < pinned.size(); ++v) row_[v] = pinned[v] ? kInvalid : last_row_++;
  std::replace(row_.begin(), row_.end(), kInvalid, last_row_);
}

std::vector<double> NewtonSystem::by_rows(const std::vector<double>& values) const {
  if (row_.empty()) return values;
  std::vector<double> rows(at(last_row_) + 1, 0.0);
  for (std::size_t v = 0; v < values.size(); ++v) {
    if (row_[v] == last_row_) continue;
    rows[at(row_[v])] = values[v];
    rows.back() -= values[v];
  }
  return rows;
}

template <typename T>
void NewtonSystem::by_unknowns(std::vector<T>& values) const {
  if (row_.empty() || values.empty()) return;
  std::vector<T> all;
  for (const Index row : row_) all.push_back(values[at(row)]);
  values = std::move(all);
}

bool NewtonSystem::collect_couplings(const intrinsic::IntrinsicMesh& mesh,
                                     const Gradient& gradient) {
  // By the lower row, then the higher one. Edges of copy 2 couple the same unknowns as their mirror
  // images; only their part from symmetric faces is not zero.
  using intrinsic::EdgeLabel;
  using Couplings = Lists<numeric::Coupling>;
  const std::size_t rows = at(row_count(gradient.value.size()));
  const Couplings by_high(rows, [&](const auto& add) {
    for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
      const Index a = row_of(mesh.unknown[at(mesh.origin[2 * e])]);
      const Index b = row_of(mesh.unknown[at(mesh.origin[2 * e + 1])]);
      const EdgeLabel label = mesh.label_of_edge(static_cast<EdgeId>(e));
      if (a == b || label == EdgeLabel::kDiagonal) continue;
      const double w = gradient.half_cotangent[2 * e] + gradient.half_cotangent[2 * e + 1];
      if (w != 0.0 || label != EdgeLabel::kTwo)
        add(std::max(a, b), {std::min(a, b), std::max(a, b), w});
    }
  });
  const Couplings by_low(rows, [&](const auto& add) {
    for (Index high = 0; high < by_high.size(); ++high)
      for (const numeric::Coupling& c : by_high[high]) add(c.low, c);
  });
  couplings_.clear();
  for (Index low = 0; low < by_low.size(); ++low) {
    for (const numeric::Coupling& c : by_low[low]) {
      if (!couplings_.empty() && couplings_.back().low == low && couplings_.back().high == c.high) {
        couplings_.back().weight += c.weight;
      } else {
        couplings_.push_back(c);
      }
    }
  }
  // Delaunay weights are not negative; what rounding says otherwise is zero.
  bool finite = true;
  for (numeric::Coupling& c : couplings_) {
    finite = finite && std::isfinite(c.weight);
    c.weight = std::max(c.weight, 0.0);
  }
  return finite;
}

void NewtonSystem::build_matrix(Index last) {
  // Couplings are sorted by columns, the lower numbers.
  matrix_.resize(last, last);
  matrix_.reserve(last + std::ssize(couplings_));
  auto next = couplings_.begin();
  for (Index column = 0; column < last; ++column) {
    matrix_.startVec(column);
    matrix_.insertBack(column, column) = 0.0;
    for (; next != couplings_.end() && next->low == column; ++next)
      if (next->high != last) matrix_.insertBack(next->high, column) = -next->weight;
  }
  matrix_.finalize();
  for (const numeric::Coupling& c : couplings_) {
    matrix_.valuePtr()[matrix_.outerIndexPtr()[c.low]] += c.weight;
    if (c.high != last) matrix_.valuePtr()[matrix_.outerIndexPtr()[c.high]] += c.weight;
  }
}

double NewtonSystem::residual(const std::vector<double>& g, const FineVector& d,
                              std::vector<double>& r) const {
  // H d as weighted differences: no cancellation of diagonals.
  for (std::size_t i = 0; i < g.size(); ++i) r[i] = -g[i];
  for (const numeric::Coupling& c : couplings_) {
    const double flow = c.weight * difference_along(c, d);
    r[at(c.low)] += flow;
    r[at(c.high)] -= flow;
  }
  return largest_of(r.begin(), r.end() - 1);
}

double NewtonSystem::rounding(const FineVector& d) const {
  double largest = 0.0;
  for (const numeric::Coupling& c : couplings_) {
    const double size = std::max(std::abs(d.high[at(c.low)]), std::abs(d.high[at(c.high)]));
    largest = std::max(largest, c.weight * size * std::numeric_limits<double>::epsilon());
  }
  return largest;
}

bool NewtonSystem::factorize(ExecutionContext& context) {
  const std::span outer(matrix_.outerIndexPtr(), at(matrix_.cols() + 1));
  const std::span inner(matrix_.innerIndexPtr(), at(matrix_.nonZeros()));
  if (!std::ranges::equal(outer, analysed_outer_) || !std::ranges::equal(inner, analysed_inner_)) {
    cholesky_.analyze(matrix_, context);
    analysed_outer_.assign(outer.begin(), outer.end());
    analysed_inner_.assign(inner.begin(), inner.end());
  }
  return cholesky_.factorize(matrix_, context);
}

bool NewtonSystem::factorize(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                             ExecutionContext& context) {
  if (!collect_couplings(mesh, gradient)) return false;
  const Index last = row_count(gradient.value.size()) - 1;
  build_matrix(last);
  use_accurate_ = last > 0 && !factorize(context);
  return !use_accurate_ || accurate_.factorize(last + 1, couplings_, context);
}

Eigen::MatrixXd NewtonSystem::solve_columns(const Eigen::Ref<const Eigen::MatrixXd>& columns,
                                            ExecutionContext& context) const {
  const Eigen::Index last = columns.rows() - 1;
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(columns.rows(), columns.cols());
  if (last > 0 && !use_accurate_) x.topRows(last) = cholesky_.solve(columns.topRows(last), context);
  for (Eigen::Index k = 0; use_accurate_ && k < columns.cols(); ++k) {
    std::vector<double> column(columns.col(k).begin(), columns.col(k).end());
    accurate_.solve(column, context);
    x.col(k) = Eigen::Map<const Eigen::VectorXd>(column.data(), columns.rows());
  }
  return x;
}

std::vector<double> NewtonSystem::solve_pinned(const std::vector<double>& b,
                                               ExecutionContext& context) const {
  const std::vector<double> rows = by_rows(b);
  const Eigen::VectorXd x = solve_columns(
      Eigen::Map<const Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size())),
      context);
  std::vector<double> found(x.begin(), x.end());
  by_unknowns(found);
  return found;
}

// Residual left; infinite if the matrix is not positive definite to working precision.
double NewtonSystem::by_cholesky(const std::vector<double>& g, double goal, FineVector& d,
                                 ExecutionContext& context) {
  double residual_left = std::numeric_limits<double>::infinity();
  const auto last = static_cast<Eigen::Index>(g.size() - 1);
  build_matrix(static_cast<Index>(last));
  if (!factorize(context)) return residual_left;
  clear(d, g.size());
  std::vector<double> r(g.size());
  Eigen::VectorXd rhs(last);
  double before = residual(g, d, r);
  for (int round = 0; round < kRefinementRounds; ++round) {
    std::copy(r.begin(), r.end() - 1, rhs.data());
    const Eigen::VectorXd x = cholesky_.solve(rhs, context);
    for (Eigen::Index i = 0; i < last; ++i) add(d, static_cast<std::size_t>(i), x[i]);
    residual_left = residual(g, d, r);
    if (!(residual_left > goal) || residual_left > 0.5 * before) break;
    before = residual_left;
  }
  return residual_left;
}

// Without any subtraction. Residual left.
double NewtonSystem::by_accurate_factor(const std::vector<double>& g, double error, int bits,
                                        FineVector& d, ExecutionContext& context) {
  const std::size_t n = g.size();
  double residual_left = std::numeric_limits<double>::infinity();
  if (!accurate_.factorize(static_cast<Index>(n), couplings_, context)) return residual_left;
  using Number = numeric::BigFloat<16>;
  const Number zero(0.0, std::clamp(bits, kLeastBits, Number::kMaxBits));
  d.low.clear();
  d.full.assign(n, zero);
  // The residual in full as well: what flows through a heavy coupling must leave its ends in
  // balance.
  std::vector<Number> r(n, zero);
  for (std::size_t i = 0; i < n; ++i) r[i] -= Number(g[i]);
  double before = std::numeric_limits<double>::infinity();
  std::vector<Number> last;
  for (int round = 0; round < kAccurateRounds; ++round) {
    context.check();
    accurate_.solve(r, context);
    last = d.full;
    for (std::size_t i = 0; i < n; ++i) {
      d.full[i] += r[i];
      r[i] = zero - Number(g[i]);
    }
    for (const numeric::Coupling& c : couplings_) {
      const Number flow(c.weight * (d.full[at(c.high)] - d.full[at(c.low)]).to_double());
      r[at(c.low)] += flow;
      r[at(c.high)] -= flow;
    }
    std::vector<double> rounded;
    for (std::size_t i = 0; i + 1 < n; ++i) rounded.push_back(r[i].to_double());
    residual_left = largest_of(rounded.begin(), rounded.end());
    if (!(residual_left < 0.5 * before)) {
      residual_left = before;
      std::swap(d.full, last);
      break;
    }
    before = residual_left;
    if (before <= 1e-12 * error) break;
  }
  d.high.resize(n);
  for (std::size_t i = 0; i < n; ++i) d.high[i] = d.full[i].to_double();
  return residual_left;
}

bool NewtonSystem::solve(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient, int bits,
                         FineVector& d, ExecutionContext& context) {
  const std::vector<double> g = without_mean(by_rows(gradient.value));
  const double error = gradient.max_error;
  clear(d, g.size());
  // Angles that doubles cannot tell from 0 or pi have no cotangent.
  if (!std::isfinite(error) || !collect_couplings(mesh, gradient)) return false;
  // Cholesky first; where it fails or leaves a residual, the factorization that is accurate entry
  // by entry.
  double residual_left = std::numeric_limits<double>::infinity();
  if (!use_accurate_) residual_left = by_cholesky(g, 1e-10 * error, d, context);
  if (!(residual_left <= 1e-8 * error)) {
    use_accurate_ = true;
    residual_left = by_accurate_factor(g, error, bits, d, context);
  }
  if (!(residual_left < 0.5 * error) || !std::isfinite(largest_of(d.high.begin(), d.high.end())))
    return false;
  slope_ = 0.0;
  for (const numeric::Coupling& c : couplings_) {
    const double difference = difference_along(c, d);
    slope_ -= c.weight * difference * difference;
  }
  const auto [low, high] = std::minmax_element(d.high.begin(), d.high.end());
  const double middle = row_.empty() ? 0.5 * (*low + *high) : 0.0;
  for (std::size_t i = 0; i < d.high.size(); ++i) {
    if (d.full.empty()) {
      add(d, i, -middle);
    } else {
      d.full[i] -= numeric::BigFloat<16>(middle);
      d.high[i] = d.full[i].to_double();
    }
  }
  if (!d.low.empty() && rounding(d) <= kNegligible * error) d.low.clear();
  by_unknowns(d.high);
  by_unknowns(d.low);
  by_unknowns(d.full);
  return true;
}

}  // namespace flipfree::conformal
