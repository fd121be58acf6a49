// Where the vertices of a graph lie in the tree of its nested dissection (dissection_tree.h).
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace flipfree::numeric {

// A node by its path from the root, 0 = left, 1 = right, first step in the highest bit; padded with
// ones, and 63 - depth in the six lowest bits: keys in ascending order are the postorder.
class TreeNode {
 public:
  static constexpr int kDeepest = 57;

  constexpr TreeNode() = default;  // the root
  constexpr TreeNode child(int side) const {
    const int d = depth() + 1;
    const std::uint64_t bit = std::uint64_t{1} << (64 - d);
    return TreeNode((key_ & ~bit) | (side != 0 ? bit : 0), d);
  }
  constexpr int depth() const { return 63 - static_cast<int>(key_ & 63); }
  constexpr std::uint64_t key() const { return key_; }
  // Which child of its ancestor at `depth` it lies below; depth < depth().
  constexpr int side_at(int depth) const { return static_cast<int>(key_ >> (63 - depth)) & 1; }
  // Depth of the lowest common node.
  friend constexpr int common_depth(TreeNode a, TreeNode b) {
    const int equal = std::countl_zero((a.key_ ^ b.key_) & ~std::uint64_t{63});
    return std::min({equal, a.depth(), b.depth()});
  }
  // Is one of them an ancestor of the other (or the same)?
  friend constexpr bool on_one_branch(TreeNode a, TreeNode b) {
    return common_depth(a, b) == std::min(a.depth(), b.depth());
  }
  constexpr TreeNode ancestor(int depth) const { return TreeNode(key_, depth); }
  friend constexpr bool operator==(TreeNode a, TreeNode b) = default;

 private:
  constexpr TreeNode(std::uint64_t path, int depth)
      : key_(((path | (~std::uint64_t{0} >> depth)) & ~std::uint64_t{63}) |
             static_cast<std::uint64_t>(63 - depth)) {}
  std::uint64_t key_ = ~std::uint64_t{0};
};

// Node of every vertex of a graph.
using DissectionTree = std::vector<TreeNode>;

}  // namespace flipfree::numeric
