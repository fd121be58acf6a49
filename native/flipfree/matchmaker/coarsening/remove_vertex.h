// Removes an added vertex from a refined map: what fills its star then.
//
// Every new triangle is positive in the input face it lies in, by exact test; a star that lies on
// an edge of the input is retriangulated on both sides of that edge. In the map triangles are
// positive as well, or, for a caller that untangles afterwards, as far as may be.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

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

// The star of a vertex and what is to replace it.
struct StarFilling {
  std::vector<FaceId> star;
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  std::vector<FaceId> parents;  // per triangle
};

class VertexRemover {
 public:
  // The map must outlive it. Measures the map's energy: O(#F).
  VertexRemover(mesh::RefinedMap& map, const ExecutionContext& context);

  // Removes v if the map stays valid, also as stored, and no triangle becomes worse than the worst
  // removed or a few times the map's mean energy. Cost: O(valence^3).
  bool remove(VertexId v);

  // The triangulation that is best in the map, whether or not all of it is positive there. False
  // if the star is not where its support says, or has too many corners.
  bool fill(VertexId v, StarFilling& filling) { return fill(v, true, filling); }

 private:
  // One side of a star: corners counter-clockwise, closed by the edge from the last to the first.
  struct Side {
    std::vector<VertexId> corners;
    FaceId parent = kInvalid;
  };

  bool fill(VertexId v, bool turned_over, StarFilling& filling);
  bool split_star(VertexId v, std::vector<Side>& sides) const;
  bool triangulate(const Side& side, bool turned_over,
                   std::vector<mesh::EditableTriangulation::Triangle>& triangles);
  double angle(VertexId v) const;
  bool on_edge_of(VertexId v, VertexId w) const;
  double energy(VertexId a, VertexId b, VertexId c) const;
  void measure(const ExecutionContext& context);
  const mesh::Support& support(VertexId v) const { return map_.surface.support[at(v)]; }
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }

  mesh::RefinedMap& map_;
  mesh::EditableTriangulation& mesh_;
  double scale2_ = 1;  // square of the best global scale
  double mean_ = 0;    // energy of the map
  double bound_ = 0;   // of the new triangles of the star at hand
  PolygonFiller filler_;
};

// One pass over the vertices from `keep` on that are not held, the last added first: each goes
// where the map stays valid without it. Removed ones are compacted away; vertices below `keep` keep
// their ids. Returns the number removed.
Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context);

// Takes refinement back where the vertices around have to move for it: an added vertex is left out,
// its star filled whether or not all of it is positive, and the neighbourhood untangled
// (untangle.h), its rim held.
//
// What remove_vertex.h leaves behind are local minima: no vertex can go as the others lie, although
// most can when their neighbours make room.

// Newton steps per vertex where a vertex less is worth twice the usual time.
inline constexpr int kThoroughIterations = 80;

struct UntangleRemovalOptions {
  int rings = 2;        // vertices within so many edges of the one that is removed may move
  int iterations = 40;  // Newton steps per vertex at the most
};

// One pass over the vertices from `keep` on that are not held, the last first. The boundary does
// not move, nor do `held` vertices. The map stays valid, also as stored, and interior vertices go
// on winding once. Returns the number removed; vertices stay as isolated ones until compacted.
// Cost: some twenty Newton steps on fifty triangles per vertex, half a millisecond; with one ring a
// third of it.
Index remove_by_untangling(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           ExecutionContext& context, const UntangleRemovalOptions& options = {});

}  // namespace flipfree::matchmaker
