// Seam edges with one translation: disjoint sets with a quarter turn between each edge and the root
// of its branch.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "flipfree/numeric/exact_elimination.h"

namespace flipfree::distortion {

class Branches {
 public:
  explicit Branches(std::size_t count);

  // The lowest edge of e's branch, and the unit: t of e = unit times t of that one.
  std::pair<Index, numeric::GaussianInteger> root(Index e);
  // t of e = unit times t of f. If they have one root already: what must be zero for that; else
  // empty.
  numeric::LinearForm join(Index e, const numeric::GaussianInteger& unit, Index f);

 private:
  std::vector<Index> parent_;
  std::vector<numeric::GaussianInteger> unit_;
};

}  // namespace flipfree::distortion
