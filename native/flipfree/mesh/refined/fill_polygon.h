// The best triangulation of a polygon without inner vertices.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace flipfree::mesh {

// Minimises the worst cost of a triangle, by dynamic programming over the chords (Klincsek 1980);
// O(n^3) costs at the most. Keeps its storage from polygon to polygon.
class PolygonFiller {
 public:
  static constexpr double kForbidden = std::numeric_limits<double>::infinity();

  // Corners are 0 ... n - 1 in order, n >= 3. chord(i, j), i < j: whether the two may be joined;
  // not asked for sides. cost(i, k, j, limit), i < k < j: of a triangle, kForbidden if there may be
  // none; whatever is not below the limit serves as kForbidden does. False if there is no
  // triangulation.
  template <class Chord, class Cost>
  bool fill(std::size_t n, const Chord& chord, const Cost& cost) {
    n_ = n;
    best_.assign(n * n, kForbidden);
    apex_.assign(n * n, 0);
    for (std::size_t i = 0; i + 1 < n; ++i) best_[i * n + i + 1] = -kForbidden;
    for (std::size_t length = 2; length < n; ++length) {
      for (std::size_t i = 0; i + length < n; ++i) {
        const std::size_t j = i + length;
        double& best = best_[i * n + j];
        if (length + 1 < n && !chord(i, j)) continue;
        for (std::size_t k = i + 1; k < j; ++k) {
          const double parts = std::max(best_[i * n + k], best_[k * n + j]);
          if (parts >= best) continue;
          const double worst = std::max(parts, cost(i, k, j, best));
          if (worst >= best) continue;
          best = worst;
          apex_[i * n + j] = k;
        }
      }
    }
    return best_[n - 1] < kForbidden;
  }

  // visit(i, k, j) for each triangle of the last polygon. Precondition: fill was true.
  template <class Visit>
  void for_each_triangle(const Visit& visit) {
    open_.assign(1, {0, n_ - 1});
    while (!open_.empty()) {
      const auto [i, j] = open_.back();
      open_.pop_back();
      if (j == i + 1) continue;
      const std::size_t k = apex_[i * n_ + j];
      visit(i, k, j);
      open_.push_back({i, k});
      open_.push_back({k, j});
    }
  }

 private:
  std::size_t n_ = 0;
  std::vector<double> best_;       // of the chord i, j: n i + j
  std::vector<std::size_t> apex_;  // likewise
  std::vector<std::array<std::size_t, 2>> open_;
};

}  // namespace flipfree::mesh
