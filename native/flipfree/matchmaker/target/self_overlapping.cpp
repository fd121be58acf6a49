#include "flipfree/matchmaker/target/self_overlapping.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Which chords (i, j), i < j, close a sub-polygon i..j that is triangulated, and by which third
// corner.
class ChordTable {
 public:
  explicit ChordTable(std::size_t n)
      : n_(n), words_((n + 63) / 64), from_(n * words_), to_(n * words_), apex_(n * n, kInvalid) {
    for (std::size_t i = 0; i + 1 < n; ++i) set(i, i + 1, kInvalid);
  }

  void set(std::size_t i, std::size_t j, Index apex) {
    from_[i * words_ + j / 64] |= std::uint64_t{1} << (j % 64);
    to_[j * words_ + i / 64] |= std::uint64_t{1} << (i % 64);
    apex_[i * n_ + j] = apex;
  }
  Index apex(std::size_t i, std::size_t j) const { return apex_[i * n_ + j]; }

  // The first k in (i, j) for which both (i, k) and (k, j) are closed and accept(k); kInvalid if
  // there is none.
  template <typename Accept>
  Index find_apex(std::size_t i, std::size_t j, const Accept& accept) const {
    const std::uint64_t* row = &from_[i * words_];
    const std::uint64_t* column = &to_[j * words_];
    for (std::size_t w = i / 64; w <= j / 64; ++w) {
      std::uint64_t both = row[w] & column[w];
      while (both != 0) {
        const auto k =
            static_cast<Index>(w * 64 + static_cast<std::size_t>(std::countr_zero(both)));
        if (accept(k)) return k;
        both &= both - 1;
      }
    }
    return kInvalid;
  }

 private:
  std::size_t n_;
  std::size_t words_;
  std::vector<std::uint64_t> from_;  // row i: bits j
  std::vector<std::uint64_t> to_;    // row j: bits i
  std::vector<Index> apex_;
};

Triangles read_triangles(const ChordTable& table, std::size_t n) {
  Triangles triangles(static_cast<Eigen::Index>(n) - 2, 3);
  std::vector<std::pair<std::size_t, std::size_t>> chords = {{0, n - 1}};
  Eigen::Index count = 0;
  while (!chords.empty()) {
    const auto [i, j] = chords.back();
    chords.pop_back();
    const Index k = table.apex(i, j);
    if (k == kInvalid) continue;
    triangles.row(count++) << static_cast<Index>(i), k, static_cast<Index>(j);
    chords.emplace_back(i, static_cast<std::size_t>(k));
    chords.emplace_back(static_cast<std::size_t>(k), j);
  }
  return triangles;
}

// Corners whose triangles' angles sum to theta + 2 pi k with k > 0. Sums of angles are counted in
// double: they differ by whole turns, far above rounding.
std::vector<Index> singular_corners(const Polygon& polygon, const Triangles& triangles) {
  std::vector<double> angle(polygon.size(), 0.0);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    for (Index k = 0; k < 3; ++k) {
      const auto corner = [&](Index c) -> const Vector2& {
        return polygon[at(triangles(t, c % 3))];
      };
      const Vector2 a = corner(k + 1) - corner(k);
      const Vector2 b = corner(k + 2) - corner(k);
      angle[at(triangles(t, k))] += std::abs(turn(a, b));
    }
  }
  std::vector<Index> singular;
  for (std::size_t i = 0; i < angle.size(); ++i) {
    if (angle[i] > 2 * std::numbers::pi + 1e-6) singular.push_back(static_cast<Index>(i));
  }
  return singular;
}

}  // namespace

SelfOverlap find_self_overlap(const Polygon& polygon, const ExecutionContext& context) {
  SelfOverlap result;
  result.turning_number = turning_number(polygon);
  const std::size_t n = polygon.size();
  if (result.turning_number < 1 || n < 3) return result;
  ChordTable table(n);
  for (std::size_t j = 2; j < n; ++j) {
    context.check();
    // Descending i: (i, k) with k < j was decided in earlier rounds, (k, j) with k > i earlier in
    // this one.
    for (std::size_t i = j - 1; i-- > 0;) {
      const Index apex = table.find_apex(i, j, [&](Index k) {
        return numeric::orientation(polygon[i], polygon[at(k)], polygon[j]) > 0;
      });
      if (apex != kInvalid) table.set(i, j, apex);
    }
  }
  if (table.apex(0, n - 1) == kInvalid) return result;
  result.exists = true;
  result.triangles = read_triangles(table, n);
  if (result.turning_number > 1)
    result.singular_corners = singular_corners(polygon, result.triangles);
  return result;
}

}  // namespace flipfree::matchmaker
