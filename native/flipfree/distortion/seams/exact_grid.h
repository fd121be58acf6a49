// From a seamless map in floating point to one that is seamless exactly, in 64 and in 32 bits.
//
// All coordinates are integers, at most 2^23 in size, in units of one power of two: floats hold
// them, in the first quadrant too, and doubles hold all their sums and differences, so that every
// transition is exact as stored.
// Free coordinates are rounded, the others follow without error (constraints.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/stats.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

struct GridMap {
  Points2 uv;          // #V of the cut surface; every value is a float
  double step = 0;     // of the grid, a power of two
  Points2 transition;  // per seam edge: translation from h's side to o's, exact
};

// `uv` is flip-free by the exact test and meets the constraints up to rounding; `seams` are those
// that the constraints were made of. Every component is
// centred at the origin, not scaled. Guarantee: every
// triangle is positively oriented and every seam edge's two sides are related by its quarter turn
// and by the translation given, exactly; edges of one branch have one translation, up to their
// units. `unit`: components are centred by multiples of it, and translations, lines and held places
// that are multiples of it stay so, as far as the grid is fine enough; 0: there is none. `held`:
// nodes that no repair moves (flags; empty: none). Triangles that rounding would fold are opened
// again by moving free positions around them on the grid, or in 64 bits over a region that grows as
// far as it must. stats: "rounding.repaired" (free positions that are not at their nearest grid
// point), "rounding.folded" (triangles that plain rounding folds), "rounding.opened" (times that a
// region was opened), "rounding.step". Throws NotConverged (kRoundingFlips) naming the faces if the
// map needs more than 24 bits. Cost: O(#F), plus the repairs.
GridMap round_to_grid(const SeamConstraints& constraints, const Triangles& faces,
                      const std::vector<SeamEdge>& seams, const Points2& uv,
                      ExecutionContext& context, Stats& stats, double unit = 0.0,
                      const std::vector<char>& held = {});

// A map that may flip some triangles, at most `most`, moved to the grid and its flips opened there
// by moving free positions alone; nothing if that does not open them all. Translations do not
// change but by rounding.
std::optional<Points2> unfold_on_grid(const SeamConstraints& constraints, const Triangles& faces,
                                      const std::vector<SeamEdge>& seams, const Points2& uv,
                                      std::size_t most, ExecutionContext& context);

// Opens triangles that rounding has folded, by moving free positions on the integer grid.

// Integer coordinates, at most 2^23 in size, so that the whole map spans at most 2^24 and floats
// hold it wherever it is moved on its grid. Twice areas are sums that 64 bits hold.
using GridPoints = Eigen::Matrix<std::int64_t, Eigen::Dynamic, 2, Eigen::RowMajor>;

inline constexpr std::int64_t kLargestGridNumber = std::int64_t{1} << 23;

class GridRepair {
 public:
  // `points`: of all vertices, meeting the constraints; they go on to. Translations do not change,
  // nor do the nodes that are `held` (flags; empty: none).
  GridRepair(const SeamConstraints& constraints, const Triangles& faces, GridPoints& points,
             const std::vector<char>& held, const ExecutionContext& context);

  // Moves positions around the folded faces, as little as it takes, so that the triangles around
  // each get a height of one grid step; of more from round to round, so that crowds spread. Returns
  // the faces still folded.
  std::vector<FaceId> sweep(std::vector<FaceId> folded);

  // Moves the positions of the last sweep's region to where the distortion of the map from `wide`
  // (#V x 2, in steps, flip-free) to the grid is least, as long as that gets less. Precondition: no
  // face is folded; none gets folded.
  void settle(const Points2& wide);

  // Vertices that share a face with the region, and all their copies; ascending.
  std::vector<VertexId> grow(const std::vector<VertexId>& region) const;

 private:
  struct Copy {
    VertexId vertex;
    Index turns;  // it moves by i^turns times what the node moves by
  };
  bool improve(Index node);
  double score(Index node) const;
  bool settle(Index node, const Points2& wide);
  double distortion(Index node, const Points2& wide) const;
  void shift(Index node, std::int64_t x, std::int64_t y);
  bool within(Index node) const;
  bool is_held(Index node) const { return !held_.empty() && held_[at(node)] != 0; }
  std::vector<Index> nodes_of_faces(const std::vector<FaceId>& chosen) const;
  std::vector<Index> grown(const std::vector<Index>& nodes) const;

  const std::vector<char>& real_;  // per node: moves along its first axis only
  const Triangles& faces_;
  const std::vector<char>& held_;
  GridPoints& points_;
  const ExecutionContext& context_;
  std::vector<Index> node_of_;  // #V: its position node, kInvalid for cones
  Lists<Copy> copies_;          // by position node
  Lists<CornerId> corners_;     // by vertex
  std::vector<Index> region_;   // nodes that the sweep may have moved, ascending
  double enough_ = 1;           // height, in steps, beyond which nothing is gained
};

}  // namespace flipfree::distortion
