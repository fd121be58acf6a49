#include "flipfree/numeric/cholesky/symbolic_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>
#include <numeric>
#include <utility>

namespace flipfree::numeric {
namespace {

// Calls visit(j) for the columns j != i adjacent to column i.
template <typename Visit>
void for_adjacent(const Graph& graph, const std::vector<Index>& order,
                  const std::vector<Index>& position, Index i, Visit visit) {
  for (const Index u : graph[order[at(i)]]) visit(position[at(u)]);
}

// Parent of each column: the first row below the diagonal of the factor. Path compression over
// virtual ancestors.
std::vector<Index> elimination_tree(const Graph& graph, const std::vector<Index>& order,
                                    const std::vector<Index>& position) {
  const Index count = graph.size();
  std::vector<Index> parent(at(count), kInvalid);
  std::vector<Index> ancestor(at(count), kInvalid);
  for (Index i = 0; i < count; ++i) {
    for_adjacent(graph, order, position, i, [&](Index j) {
      if (j > i) return;
      while (ancestor[at(j)] != i) {
        const Index up = ancestor[at(j)];
        ancestor[at(j)] = i;
        if (up == kInvalid) {
          parent[at(j)] = i;
          return;
        }
        j = up;
        if (j == i) return;
      }
    });
  }
  return parent;
}

// Postorder of the forest: position -> column; children in ascending order.
std::vector<Index> postorder(const std::vector<Index>& parent) {
  const auto count = static_cast<Index>(parent.size());
  std::vector<Index> child(parent.size(), kInvalid);
  std::vector<Index> sibling(parent.size(), kInvalid);
  std::vector<Index> stack;
  for (Index j = count - 1; j >= 0; --j) {
    if (parent[at(j)] == kInvalid) continue;
    sibling[at(j)] = child[at(parent[at(j)])];
    child[at(parent[at(j)])] = j;
  }
  std::vector<Index> post;
  post.reserve(parent.size());
  for (Index root = 0; root < count; ++root) {
    if (parent[at(root)] != kInvalid) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const Index j = stack.back();
      const Index next = child[at(j)];
      if (next == kInvalid) {
        post.push_back(j);
        stack.pop_back();
      } else {
        child[at(j)] = sibling[at(next)];
        stack.push_back(next);
      }
    }
  }
  return post;
}

// Entries per column of the factor, diagonal included. Row i of the factor is the paths in the
// elimination tree from its entries to i. Cost: O(entries of the factor).
std::vector<Index> column_counts(const Graph& graph, const std::vector<Index>& order,
                                 const std::vector<Index>& position,
                                 const std::vector<Index>& parent) {
  std::vector<Index> counts(parent.size(), 1);
  std::vector<Index> row(parent.size(), kInvalid);  // the last one in which the column was met
  for (Index i = 0; i < graph.size(); ++i) {
    row[at(i)] = i;
    for_adjacent(graph, order, position, i, [&](Index j) {
      for (; j < i && row[at(j)] != i; j = parent[at(j)]) {
        row[at(j)] = i;
        ++counts[at(j)];
      }
    });
  }
  return counts;
}

// A supernode under construction.
struct Block {
  Index first;
  Index columns;
  Index front;  // columns and rows below
  std::int64_t zeros;

  static std::int64_t entries(std::int64_t columns, std::int64_t front) {
    return columns * front - columns * (columns - 1) / 2;
  }
};

// Is it worth storing `zeros` explicit zeros for one larger block? Small blocks cost more in calls
// than in flops.
bool worth_merging(Index columns, std::int64_t zeros, std::int64_t entries) {
  const double share = static_cast<double>(zeros) / static_cast<double>(entries);
  if (columns <= 4) return true;
  if (columns <= 12) return share < 0.5;
  if (columns <= 32) return share < 0.15;
  return share < 0.05;
}

// First columns of the relaxed supernodes, and the end.
std::vector<Index> find_supernodes(const std::vector<Index>& parent,
                                   const std::vector<Index>& counts) {
  const auto count = static_cast<Index>(parent.size());
  std::vector<Block> blocks;
  Index begin = 0;
  while (begin < count) {
    Index end = begin + 1;
    while (end < count && parent[at(end) - 1] == end && counts[at(end)] == counts[at(end) - 1] - 1)
      ++end;
    Block block{begin, end - begin, counts[at(begin)], 0};
    begin = end;
    // The block just before is the last child if its parent column lies here.
    while (!blocks.empty()) {
      const Block& child = blocks.back();
      const Index up = parent[at(child.first + child.columns) - 1];
      if (up == kInvalid || up >= end) break;
      Block merged{child.first, child.columns + block.columns, child.columns + block.front, 0};
      const std::int64_t entries = Block::entries(merged.columns, merged.front);
      merged.zeros = child.zeros + block.zeros + entries -
                     Block::entries(child.columns, child.front) -
                     Block::entries(block.columns, block.front);
      if (!worth_merging(merged.columns, merged.zeros, entries)) break;
      block = merged;
      blocks.pop_back();
    }
    blocks.push_back(block);
  }
  std::vector<Index> first;
  first.reserve(blocks.size() + 1);
  for (const Block& block : blocks) first.push_back(block.first);
  first.push_back(count);
  return first;
}

// Row structures: union of the graph's columns and the children's rows.
void find_rows(const Graph& graph, Supernodes& s, const ExecutionContext& context) {
  const Index count = s.count();
  s.rows_begin.assign(1, 0);
  s.parent.assign(at(count), kInvalid);
  std::vector<Index> mark(at(graph.size()), kInvalid);
  std::vector<Index> child(at(count), kInvalid);
  std::vector<Index> sibling(at(count), kInvalid);
  std::vector<Index> rows;
  for (Index n = 0; n < count; ++n) {
    if (n % 4096 == 0) context.check();
    rows.clear();
    const Index end = s.first[at(n) + 1];
    const auto add = [&](Index row) {
      if (row < end || mark[at(row)] == n) return;
      mark[at(row)] = n;
      rows.push_back(row);
    };
    for (Index j = s.first[at(n)]; j < end; ++j) for_adjacent(graph, s.order, s.position, j, add);
    for (Index c = child[at(n)]; c != kInvalid; c = sibling[at(c)]) {
      for (std::int64_t i = s.rows_begin[at(c)]; i < s.rows_begin[at(c) + 1]; ++i) {
        add(s.rows[at(i)]);
      }
    }
    std::sort(rows.begin(), rows.end());
    s.rows.insert(s.rows.end(), rows.begin(), rows.end());
    s.rows_begin.push_back(static_cast<std::int64_t>(s.rows.size()));
    if (!rows.empty()) {
      const Index up = s.of_column[at(rows.front())];
      s.parent[at(n)] = up;
      sibling[at(n)] = child[at(up)];
      child[at(up)] = n;
    }
  }
}

void find_relative(Supernodes& s) {
  s.relative.resize(s.rows.size());
  for (Index n = 0; n < s.count(); ++n) {
    const Index p = s.parent[at(n)];
    if (p == kInvalid) continue;
    const Index end = s.first[at(p) + 1];
    auto in_parent = s.rows_begin[at(p)];
    for (auto i = s.rows_begin[at(n)]; i < s.rows_begin[at(n) + 1]; ++i) {
      const Index row = s.rows[at(i)];
      if (row < end) {
        s.relative[at(i)] = row - s.first[at(p)];
        continue;
      }
      while (s.rows[at(in_parent)] != row) ++in_parent;
      s.relative[at(i)] = s.columns(p) + static_cast<Index>(in_parent - s.rows_begin[at(p)]);
    }
  }
}

}  // namespace

std::vector<Index> inverse(const std::vector<Index>& order) {
  std::vector<Index> position(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) position[at(order[i])] = static_cast<Index>(i);
  return position;
}

std::vector<Index> minimum_degree(const Graph& graph) {
  std::vector<Eigen::Triplet<char, Index>> entries;
  for (Index v = 0; v < graph.size(); ++v) {
    entries.emplace_back(v, v, 1);  // a vertex without is taken for one with very many neighbours
    for (const Index u : graph[v]) entries.emplace_back(u, v, 1);
  }
  Eigen::SparseMatrix<char, Eigen::ColMajor, Index> pattern(graph.size(), graph.size());
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> order;
  Eigen::AMDOrdering<Index>()(pattern, order);
  return {order.indices().data(), order.indices().data() + graph.size()};
}

Supernodes analyze_supernodes(const Graph& graph, const ExecutionContext& context) {
  Supernodes s;
  const std::vector<Index> order = minimum_degree(graph);
  context.check();
  const std::vector<Index> tree = elimination_tree(graph, order, inverse(order));
  context.check();
  const std::vector<Index> post = postorder(tree);
  const std::vector<Index> place = inverse(post);
  s.order.resize(order.size());
  std::vector<Index> parent(order.size());
  for (std::size_t i = 0; i < post.size(); ++i) {
    s.order[i] = order[at(post[i])];
    const Index up = tree[at(post[i])];
    parent[i] = up == kInvalid ? kInvalid : place[at(up)];
  }
  s.position = inverse(s.order);
  context.check();
  const std::vector<Index> counts = column_counts(graph, s.order, s.position, parent);
  context.check();
  s.first = find_supernodes(parent, counts);
  s.of_column.resize(order.size());
  for (Index n = 0; n < s.count(); ++n) {
    std::fill(s.of_column.begin() + s.first[at(n)], s.of_column.begin() + s.first[at(n) + 1], n);
  }
  find_rows(graph, s, context);
  context.check();
  find_relative(s);
  return s;
}

}  // namespace flipfree::numeric
