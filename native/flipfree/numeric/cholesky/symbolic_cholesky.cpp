#include "flipfree/numeric/cholesky/symbolic_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>
#include <iterator>
#include <span>

namespace flipfree::numeric {
namespace {

// Calls visit(j) for the columns j != i adjacent to column i.
template <typename Visit>
void for_adjacent(const Graph& graph, const std::vector<Index>& order,
                  const std::vector<Index>& position, Index i, Visit visit) {
  for (const Index u : graph[order[at(i)]]) visit(position[at(u)]);
}

// Per column: the first row of the factor below the diagonal, and its entries, diagonal included.
struct EliminationTree {
  std::vector<Index> parent, entries;
};

// Row i of the factor is the paths in the tree from its entries to i, which is the parent of what
// had none. Cost: O(entries of the factor).
EliminationTree elimination_tree(const Graph& graph, const std::vector<Index>& order,
                                 const std::vector<Index>& position) {
  const std::size_t count = order.size();
  EliminationTree tree{std::vector<Index>(count, kInvalid), std::vector<Index>(count, 1)};
  std::vector<Index> row(count, kInvalid);  // the last one in which the column was met
  for (Index i = 0; i < graph.size(); ++i) {
    row[at(i)] = i;
    for_adjacent(graph, order, position, i, [&](Index j) {
      for (; j < i && row[at(j)] != i; j = tree.parent[at(j)]) {
        if (tree.parent[at(j)] == kInvalid) tree.parent[at(j)] = i;
        row[at(j)] = i;
        ++tree.entries[at(j)];
      }
    });
  }
  return tree;
}

// The columns whose parent is this one, ascending; the last list is that of the roots.
Lists<Index> children_of(const std::vector<Index>& parent) {
  return {parent.size() + 1, [&](const auto& add) {
            const auto count = static_cast<Index>(parent.size());
            for (Index j = 0; j < count; ++j)
              add(parent[at(j)] == kInvalid ? count : parent[at(j)], j);
          }};
}

// Postorder of the forest: position -> column; children in ascending order.
std::vector<Index> postorder(const std::vector<Index>& parent) {
  const Lists<Index> children = children_of(parent);
  // Backwards: every column before its children, the last one first.
  std::vector<Index> post, stack{static_cast<Index>(parent.size())};
  while (!stack.empty()) {
    const std::span<const Index> below = children[post.emplace_back(stack.back())];
    stack.pop_back();
    stack.insert(stack.end(), below.begin(), below.end());
  }
  return {post.rbegin(), post.rend() - 1};
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
  s.children = children_of(s.parent);
  s.rows_begin.assign(1, 0);
  std::vector<Index> mark(at(graph.size()), kInvalid);
  for (Index n = 0; n < s.count(); ++n) {
    if (n % 4096 == 0) context.check();
    const Index end = s.first[at(n) + 1];
    const auto add = [&](Index row) {
      if (row < end || mark[at(row)] == n) return;
      mark[at(row)] = n;
      s.rows.push_back(row);
    };
    for (Index j = s.first[at(n)]; j < end; ++j) for_adjacent(graph, s.order, s.position, j, add);
    for (const Index c : s.children[n]) {
      for (std::int64_t i = s.rows_begin[at(c)]; i < s.rows_begin[at(c) + 1]; ++i)
        add(s.rows[at(i)]);
    }
    std::sort(s.rows.begin() + s.rows_begin.back(), s.rows.end());
    s.rows_begin.push_back(std::ssize(s.rows));
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
  const EliminationTree tree = elimination_tree(graph, order, inverse(order));
  context.check();
  const std::vector<Index> post = postorder(tree.parent);
  const std::vector<Index> place = inverse(post);
  std::vector<Index> parent, entries;
  for (const Index column : post) {
    s.order.push_back(order[at(column)]);
    entries.push_back(tree.entries[at(column)]);
    const Index up = tree.parent[at(column)];
    parent.push_back(up == kInvalid ? kInvalid : place[at(up)]);
  }
  s.position = inverse(s.order);
  s.first = find_supernodes(parent, entries);
  s.of_column.resize(order.size());
  for (Index n = 0; n < s.count(); ++n) {
    std::fill(s.of_column.begin() + s.first[at(n)], s.of_column.begin() + s.first[at(n) + 1], n);
  }
  for (Index n = 0; n < s.count(); ++n) {
    const Index up = parent[at(s.first[at(n) + 1]) - 1];
    s.parent.push_back(up == kInvalid ? kInvalid : s.of_column[at(up)]);
  }
  context.check();
  find_rows(graph, s, context);
  context.check();
  find_relative(s);
  return s;
}

}  // namespace flipfree::numeric
