// Cuts drawn by hand, and the rank of what they make, for tests.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "flipfree/seamless/padding/segments.h"
#include "fuzz/rational.h"
#include "support/shapes.h"

namespace flipfree::test {

// test::torus, whose vertex (i, j) has number sectors * j + i, with i to the right and j up as seen
// from outside, and whose squares are cut from (i, j) to (i + 1, j + 1).
struct GridTorus {
  Index sectors, rows;
  mesh::Surface surface;

  GridTorus(Index sectors_, Index rows_)
      : sectors(sectors_), rows(rows_), surface(torus(sectors_, rows_)) {}
  VertexId at(Index i, Index j) const {
    return sectors * ((j + rows) % rows) + (i + sectors) % sectors;
  }
};

using Chain = std::vector<VertexId>;

inline std::map<std::pair<VertexId, VertexId>, HalfedgeId> halfedges_of(const Triangles& faces) {
  std::map<std::pair<VertexId, VertexId>, HalfedgeId> result;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces.size()); ++h)
    result[{mesh::source(faces, h), mesh::target(faces, h)}] = h;
  return result;
}

// Branches as chains of vertices, flat sectors as the first edge of each.
inline seamless::AdmissibleCut drawn_cut(const mesh::Surface& surface,
                                         const std::vector<Chain>& branches,
                                         const std::vector<std::pair<VertexId, VertexId>>& flat) {
  const auto halfedge = halfedges_of(surface.faces);
  seamless::AdmissibleCut cut;
  cut.surface = surface;
  for (const Chain& chain : branches) {
    cut.branches.emplace_back();
    for (std::size_t k = 0; k + 1 < chain.size(); ++k)
      cut.branches.back().push_back(halfedge.at({chain[k], chain[k + 1]}));
  }
  for (const auto& edge : flat) cut.flat_sectors.push_back(halfedge.at(edge));
  return cut;
}

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

}  // namespace flipfree::test
