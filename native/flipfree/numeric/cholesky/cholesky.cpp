#include "flipfree/numeric/cholesky/cholesky.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/numeric/cholesky/multifrontal.h"
#include "flipfree/numeric/cholesky/symbolic_cholesky.h"
#include "flipfree/numeric/nested_dissection.h"

namespace flipfree::numeric {

namespace {

// A repaired order may cost so many times what a planar graph of its size is expected to.
constexpr double kDear = 1.5;

}  // namespace

bool EliminationMemory::recall(const Graph& graph, const std::vector<Index>& label,
                               std::vector<Index>& before, DissectionTree& tree) const {
  const Index count = graph.count();
  std::vector<Index> rank(at(count), kInvalid);
  Index known = 0;
  tree.assign(at(count), TreeNode());
  for (Index v = 0; v < count; ++v) {
    const std::size_t l = at(label[at(v)]);
    if (l >= rank_.size() || rank_[l] == kInvalid) continue;
    rank[at(v)] = rank_[l];
    tree[at(v)] = node_[l];
    ++known;
  }
  if (2 * known < count || count == 0) return false;
  // Breadth-first from what is known; `queue` has vertices that are placed, `rank` says which.
  const Index last = static_cast<Index>(rank_.size());  // behind all ranks
  std::vector<Index> queue;
  const auto for_neighbours = [&](Index v, auto visit) {
    for (Index i = graph.offset[at(v)]; i < graph.offset[at(v) + 1]; ++i)
      visit(graph.neighbour[at(i)]);
  };
  const auto place = [&](Index v) {
    if (rank[at(v)] != kInvalid) return;
    bool found = false;
    TreeNode deepest;
    for_neighbours(v, [&](Index u) {
      if (rank[at(u)] == kInvalid) return;
      if (!found || tree[at(u)].depth() > deepest.depth()) deepest = tree[at(u)];
      found = true;
    });
    if (!found) return;
    tree[at(v)] = deepest;
    rank[at(v)] = last + v;
    queue.push_back(v);
  };
  for (Index v = 0; v < count; ++v) place(v);
  for (std::size_t head = 0; head < queue.size(); ++head)
    for_neighbours(queue[head], [&](Index u) { place(u); });
  for (Index v = 0; v < count; ++v) {
    if (rank[at(v)] == kInvalid) rank[at(v)] = last + v;  // a component of its own
  }
  before.resize(at(count));
  std::iota(before.begin(), before.end(), Index{0});
  std::sort(before.begin(), before.end(),
            [&](Index a, Index b) { return rank[at(a)] < rank[at(b)]; });
  return true;
}

void EliminationMemory::keep(const std::vector<Index>& order, const DissectionTree& tree,
                             const std::vector<Index>& label, double flops, bool anew) {
  const Index most = label.empty() ? 0 : std::min(stable_, label.back() + 1);
  if (anew) {
    rank_.assign(at(most), kInvalid);
    node_.assign(at(most), TreeNode());
    flops_ = flops;
    count_ = static_cast<Index>(order.size());
  } else if (at(most) > rank_.size()) {
    rank_.resize(at(most), kInvalid);
    node_.resize(at(most), TreeNode());
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Index l = label[at(order[i])];
    if (l >= most) continue;
    rank_[at(l)] = static_cast<Index>(i);
    node_[at(l)] = tree[at(order[i])];
  }
}

bool EliminationMemory::dear(Index count, double flops) const {
  const double growth = static_cast<double>(count) / std::max<double>(1.0, count_);
  return flops > kDear * flops_ * std::pow(growth, 1.5);
}

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
  std::vector<Index> order;  // of the graph's vertices: unknowns, or pairs of them
  DissectionTree tree;       // of the same vertices
  Index unknowns = 0;
  bool factorized = false;
  FactorMemory memory;  // of the last factor, until there is a new one

  // Forgets the last analysis but its memory.
  void begin() {
    if (numeric) memory = numeric->take_memory();
    numeric.reset();
    factorized = false;
  }
  void set_order(std::vector<Index> elimination, const Graph& graph, Index block,
                 const SparseMatrix& matrix, ExecutionContext& context) {
    order = std::move(elimination);
    begin();
    Supernodes supernodes = analyze_supernodes(graph, order, context);
    numeric.emplace(std::move(supernodes), block, unknowns, matrix.outerIndexPtr(),
                    matrix.innerIndexPtr(), context, std::move(memory));
  }
};

SparseCholesky::SparseCholesky() : state_(std::make_unique<State>()) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

void SparseCholesky::analyze(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  state_->begin();
  state_->unknowns = static_cast<Index>(matrix.cols());
  const Index block = has_pairs(matrix) ? 2 : 1;
  const Graph graph = graph_of(matrix, block);
  context.check();
  state_->set_order(hub_dissection(graph, context, state_->tree), graph, block, matrix, context);
}

void SparseCholesky::analyze(const SparseMatrix& matrix, ExecutionContext& context,
                             EliminationMemory& memory, const std::vector<Index>& label) {
  const Index block = has_pairs(matrix) ? 2 : 1;
  if (label.size() * at(block) != at(static_cast<Index>(matrix.cols()))) {
    analyze(matrix, context);
    return;
  }
  context.check();
  state_->begin();
  state_->unknowns = static_cast<Index>(matrix.cols());
  const Graph graph = graph_of(matrix, block);
  std::vector<Index> before;
  if (memory.recall(graph, label, before, state_->tree)) {
    state_->set_order(repair_dissection(graph, before, state_->tree, context), graph, block, matrix,
                      context);
    if (!memory.dear(graph.count(), factor_flops())) {
      memory.keep(state_->order, state_->tree, label, factor_flops(), false);
      return;
    }
  }
  analyze(matrix, context);
  memory.keep(state_->order, state_->tree, label, factor_flops(), true);
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
