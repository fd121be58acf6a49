#include "flipfree/numeric/cholesky/cholesky.h"

#include <algorithm>
#include <optional>
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
  Graph graph;
  graph.offset.assign(at(count) + 1, 0);
  const auto for_edges = [&](auto visit) {
    for (Index v = 0; v < count; ++v) {
      const Column column = lower_column(matrix, block * v);
      for (const Index* row = column.begin; row != column.end; row += block) {
        if (*row / block != v) visit(v, *row / block);
      }
    }
  };
  for_edges([&](Index v, Index u) {
    ++graph.offset[at(v) + 1];
    ++graph.offset[at(u) + 1];
  });
  for (Index v = 0; v < count; ++v) graph.offset[at(v) + 1] += graph.offset[at(v)];
  graph.neighbour.resize(at(graph.offset.back()));
  std::vector<Index> next(graph.offset.begin(), graph.offset.end() - 1);
  for_edges([&](Index v, Index u) {
    graph.neighbour[at(next[at(v)]++)] = u;
    graph.neighbour[at(next[at(u)]++)] = v;
  });
  return graph;
}

}  // namespace

struct SparseCholesky::State {
  std::optional<Multifrontal> numeric;
  Index unknowns = 0;
  bool factorized = false;
  FactorMemory memory;  // of the last factor, until there is a new one
};

SparseCholesky::SparseCholesky() : state_(std::make_unique<State>()) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

void SparseCholesky::analyze(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  if (state_->numeric) state_->memory = state_->numeric->take_memory();
  state_->numeric.reset();
  state_->factorized = false;
  state_->unknowns = static_cast<Index>(matrix.cols());
  const Index block = has_pairs(matrix) ? 2 : 1;
  const Graph graph = graph_of(matrix, block);
  context.check();
  state_->numeric.emplace(analyze_supernodes(graph, context), block, state_->unknowns,
                          matrix.outerIndexPtr(), matrix.innerIndexPtr(), context,
                          std::move(state_->memory));
}

bool SparseCholesky::factorize(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  if (!state_->numeric || matrix.cols() != state_->unknowns) {
    throw InternalError("factorize() without analyze() of the same pattern");
  }
  state_->factorized = false;
  state_->factorized = state_->numeric->factorize(matrix.valuePtr(), context);
  return state_->factorized;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                                      ExecutionContext& context) const {
  context.check();
  if (!state_->factorized) throw InternalError("solve() without a successful factorize()");
  Eigen::MatrixXd x = rhs;
  state_->numeric->solve(x.data(), static_cast<Index>(x.cols()), context);
  return x;
}

std::int64_t SparseCholesky::factor_nonzeros() const {
  return state_->numeric ? state_->numeric->factor_nonzeros() : 0;
}

double SparseCholesky::factor_flops() const {
  return state_->numeric ? state_->numeric->flops() : 0;
}

}  // namespace flipfree::numeric
