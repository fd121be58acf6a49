// Surfaces and cones to make cuts of, and everything that padding needs of a cut, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/padding/segments.h"
#include "fuzz/rational.h"
#include "seamless/admissible_judge.h"
#include "seamless/cones.h"

namespace flipfree::test {

// Of the matrix, without the columns of segments that must not be padded if asked; by elimination
// in rational numbers.
inline Index rank_of(const seamless::EqualizationSystem& system, bool without_unpadded) {
  using fuzz::Rational;
  std::vector<std::map<Index, Rational>> rows;
  for (const seamless::EqualizationRow& row : system.rows) {
    rows.emplace_back();
    for (const auto& [segment, coefficient] : row.terms) rows.back()[segment] = coefficient;
    if (!without_unpadded) continue;
    for (const Index segment : system.unpadded) rows.back().erase(segment);
  }
  Index rank = 0;
  while (!rows.empty()) {
    const std::map<Index, Rational> pivot = rows.back();
    rows.pop_back();
    if (pivot.empty()) continue;
    ++rank;
    const auto& [column, value] = *pivot.begin();
    for (auto& row : rows) {
      const auto entry = row.find(column);
      if (entry == row.end()) continue;
      const Rational factor = entry->second / value;
      for (const auto& [c, x] : pivot) {
        Rational& y = row[c];
        y -= factor * x;
        if (y == 0) row.erase(c);
      }
    }
  }
  return rank;
}

// Is the vector of ones, with zeros where nothing may be padded, in the kernel? Then every solution
// can be made positive.
inline bool ones_are_in_kernel(const seamless::EqualizationSystem& system) {
  std::vector<Index> ones(static_cast<std::size_t>(system.unknowns), 1);
  for (const Index segment : system.unpadded) ones[static_cast<std::size_t>(segment)] = 0;
  for (const seamless::EqualizationRow& row : system.rows) {
    Index sum = 0;
    for (const auto& [segment, coefficient] : row.terms)
      sum += coefficient * ones[static_cast<std::size_t>(segment)];
    if (sum != 0) return false;
  }
  return true;
}

// Definition 5.4 by the judge; a row of ones in the kernel, and full rank, so that the equations
// can be solved by positive widths whatever the lengths are, unless all cones are multiples of four
// (Proposition 10). Returns the corners of the components.
inline std::multiset<Index> expect_good_cut(const seamless::AdmissibleCut& cut,
                                            const mesh::Surface& surface,
                                            const std::vector<Index>& cones) {
  AdmissibleJudge judge(cut, surface, cones);
  EXPECT_EQ(judge.complaint(), "");
  const mesh::Adjacency adjacency = mesh::build_adjacency(cut.surface);
  const seamless::EqualizationSystem system =
      seamless::equalization_system(cut, seamless::cut_segments(cut, adjacency));
  EXPECT_TRUE(ones_are_in_kernel(system));
  const bool fourfold = std::all_of(cones.begin(), cones.end(), [](Index k) { return k % 4 == 0; });
  if (!fourfold) {
    EXPECT_EQ(rank_of(system, true), static_cast<Index>(system.rows.size()));
  }
  EXPECT_EQ(cut.extra_path == kInvalid, cut.flat_sectors.empty());
  return judge.corner_counts();
}

inline std::multiset<Index> expect_good_cut(const mesh::Surface& surface,
                                            const std::vector<Index>& cones) {
  ExecutionContext context;
  return expect_good_cut(seamless::make_admissible_cut(surface, cones, context), surface, cones);
}

}  // namespace flipfree::test
