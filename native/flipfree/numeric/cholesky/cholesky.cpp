#include "flipfree/numeric/cholesky/cholesky.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/numeric/cholesky/multifrontal.h"
#include "flipfree/numeric/cholesky/symbolic_cholesky.h"

namespace flipfree::numeric {

namespace {

// Lower triangle as sorted ranges, whatever else the matrix stores.
struct Column {
  const Index* begin;
  const Index* end;
};
Column lower_column(const SparseMatrix& matrix, Index j) {
  const Index* begin = matrix.innerIndexPtr() + matrix.outerIndexPtr()[j];
  const Index* end = matrix.innerIndexPtr() + matrix.outerIndexPtr()[j + 1];
  return {std::lower_bound(begin, end, j), end};
}

// Do unknowns 2 i and 2 i + 1 always occur together? Then the graph has half the vertices and a
// quarter of the edges.
bool has_pairs(const SparseMatrix& matrix) {
  if (matrix.rows() % 2 != 0) return false;
  for (Index j = 0; j < static_cast<Index>(matrix.cols()); j += 2) {
    const Column even = lower_column(matrix, j);
    const Column odd = lower_column(matrix, j + 1);
    if ((even.end - even.begin) % 2 != 0 || even.end - even.begin < 2 || even.begin[0] != j ||
        even.begin[1] != j + 1) {
      return false;
    }
    if (odd.end - odd.begin != even.end - even.begin - 1 ||
        !std::equal(odd.begin, odd.end, even.begin + 1)) {
      return false;
    }
    for (const Index* row = even.begin + 2; row != even.end; row += 2) {
      if (row[0] % 2 != 0 || row[1] != row[0] + 1) return false;
    }
  }
  return true;
}

Graph graph_of(const SparseMatrix& matrix, Index block) {
  const Index count = static_cast<Index>(matrix.cols()) / block;
  return {at(count), [&](const auto& add) {
            for (Index v = 0; v < count; ++v) {
              const Column column = lower_column(matrix, block * v);
              for (const Index* row = column.begin; row != column.end; row += block) {
                const Index u = *row / block;
                if (u == v) continue;
                add(v, u);
                add(u, v);
              }
            }
          }};
}

}  // namespace

SparseCholesky::SparseCholesky() = default;
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

void SparseCholesky::analyze(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  FactorMemory memory = numeric_ ? numeric_->take_memory() : FactorMemory{};
  numeric_.reset();
  factorized_ = false;
  unknowns_ = static_cast<Index>(matrix.cols());
  const Index block = has_pairs(matrix) ? 2 : 1;
  const Graph graph = graph_of(matrix, block);
  context.check();
  numeric_ = std::make_unique<Multifrontal>(analyze_supernodes(graph, context), block, unknowns_,
                                            matrix.outerIndexPtr(), matrix.innerIndexPtr(), context,
                                            std::move(memory));
}

bool SparseCholesky::factorize(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  if (!numeric_ || matrix.cols() != unknowns_)
    throw InternalError("factorize() without analyze() of the same pattern");
  factorized_ = false;
  factorized_ = numeric_->factorize(matrix.valuePtr(), context);
  return factorized_;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                                      ExecutionContext& context) const {
  context.check();
  if (!factorized_) throw InternalError("solve() without a successful factorize()");
  Eigen::MatrixXd x = rhs;
  numeric_->solve(x.data(), static_cast<Index>(x.cols()), context);
  return x;
}

}  // namespace flipfree::numeric
