// Disjoint sets of indices with path halving (Tarjan and van Leeuwen 1984).
#pragma once

#include <numeric>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree {

class DisjointSets {
 public:
  explicit DisjointSets(Index count) : parent_(static_cast<std::size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  // The representative of i's set.
  Index find(Index i) {
    while (parent_[at(i)] != i) {
      Index& p = parent_[at(i)];
      p = parent_[at(p)];
      i = p;
    }
    return i;
  }

  // The set of a becomes part of that of b, whose representative stays. False if they were one set.
  bool join(Index a, Index b) {
    a = find(a);
    b = find(b);
    if (a == b) return false;
    parent_[static_cast<std::size_t>(a)] = b;
    return true;
  }

  // Of each index the smallest one of its set.
  std::vector<Index> firsts() {
    std::vector<Index> first(parent_.size(), kInvalid), all;
    for (Index i = 0; at(i) < parent_.size(); ++i) {
      Index& own = first[at(find(i))];
      if (own == kInvalid) own = i;
      all.push_back(own);
    }
    return all;
  }

 private:
  std::vector<Index> parent_;
};

}  // namespace flipfree
