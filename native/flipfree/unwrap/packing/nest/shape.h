// What is packed: outlines in the plane that turn, move and grow as one.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"

namespace flipfree::unwrap {

using Loop = Points2;  // corners, closed; what it bounds on the left

// From the least to the largest of some numbers.
struct Span {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

// One item about its own origin, at scale 1: the outlines of its islands, with fewer corners than
// they have. Points of which an outline winds around other than 0 times are inside.
struct Shape {
  std::vector<Loop> loops;
  // The islands reach at most so far beyond these loops (scale 1).
  double slack = 0.0;
  double area = 0.0;     // of the islands
  double radius = 0.0;   // the farthest corner from the origin
  bool upright = false;  // the islands' outlines run along the axes (straight_axis)
};

// Rows i to i + 2 of triangles' corners, counter-clockwise.
Loop triangle_of(const Points2& corners, Eigen::Index i);

// Of a point from the segment from a to b, which may be a point.
inline double distance_to_segment(const Vector2& p, const Vector2& a, const Vector2& b) {
  const Vector2 side = b - a;
  const double square = side.squaredNorm();
  const double t = square > 0.0 ? std::clamp((p - a).dot(side) / square, 0.0, 1.0) : 0.0;
  return (p - a - t * side).norm();
}

// Closed outlines of several owners, as one boundary over numbered corners.
struct Outlines {
  std::vector<Vector2> corners;
  std::vector<std::size_t> owner;  // per corner, and of the edge from there to the next one
  distortion::Boundary boundary;   // its edges and vertices

  // Calls visit(corner, edge, distance) for every corner, at `places` (#corners x 2), and edge of
  // different owners that are at most so far apart. Returns how many edges it looked at.
  template <typename Visit>
  std::size_t for_near(const Points2& places, double reach, const ExecutionContext& context,
                       Visit visit) const {
    const distortion::BoundaryGrid grid(boundary, places);
    std::vector<Index> edges;
    std::size_t looked = 0;
    for (Index c = 0; c < places.rows(); ++c) {
      if (c % 4096 == 0) context.check();
      grid.near(places.row(c), reach, edges);
      looked += edges.size();
      for (const Index e : edges) {
        const auto& [from, to] = boundary.edges[at(e)];
        if (owner[at(from)] == owner[at(c)]) continue;
        const double distance =
            distance_to_segment(places.row(c), places.row(from), places.row(to));
        if (distance <= reach) visit(c, e, distance);
      }
    }
    return looked;
  }

  void add(const Loop& loop, std::size_t of) {
    const auto first = static_cast<Index>(corners.size());
    const auto count = static_cast<Index>(loop.rows());
    for (Index i = 0; i < count; ++i) {
      boundary.edges.push_back({first + i, first + (i + 1) % count});
      boundary.vertices.push_back(first + i);
      corners.push_back(loop.row(i));
      owner.push_back(of);
    }
  }
};

// A shape of these outlines, whose middle goes to the origin; `middle` receives where it was.
// Outlines that are no more than points get a corner each. Loops must be finite.
Shape make_shape(const std::vector<Loop>& outlines, double tolerance, Vector2& middle);

// Of outlines much of which runs in two directions at a right angle - rectangles, letters like E,
// plates with holes - and of round ones, which no turn makes fit better, the turn that brings most
// of them onto the axes, by half a quarter at most; (0, 0) of others.
Vector2 straight_axis(const std::vector<Loop>& outlines);
template <typename Rows>
Eigen::AlignedBox2d bounds_of(const Eigen::MatrixBase<Rows>& uv) {
  return {uv.colwise().minCoeff().transpose(), uv.colwise().maxCoeff().transpose()};
}

// Around all of them, turned.
Eigen::AlignedBox2d box_of(const std::vector<Loop>& loops, const Vector2& turn = {1.0, 0.0});
// The turn by less than a quarter after which the square around the shape, sides along the axes, is
// smallest, up to a quarter of a degree. Cost: 360 times the corners.
Vector2 squarest_turn(const Shape& shape);

// How far points reach in some directions of the half plane.
class Spans {
 public:
  void add(const Vector2& p);
  // Across the direction in which it is narrowest.
  double length() const;
  // Of the least over the largest.
  double roundness() const;

 private:
  static constexpr std::size_t kDirections = 16;  // lengths are right to half a per cent
  double width(std::size_t i) const { return spans_[i].high - spans_[i].low; }

  std::array<Span, kDirections> spans_;
};

// Shapes as cells of a grid.

// Cells from `first` to `last` of a row, both included.
struct Run {
  int first = 0;
  int last = 0;
};

struct Mask {
  int width = 0;                    // cells
  int height = 0;                   // rows
  std::vector<int> row_begin = {};  // height + 1: the runs of each row
  std::vector<Run> runs = {};       // by row, with gaps between them
  std::span<const Run> row(int j) const {
    return {runs.data() + row_begin[at(j)], runs.data() + row_begin[at(j) + 1]};
  }
  Vector2 origin = Vector2::Zero();  // of the item from the mask's lower left corner, in cells
};

// Of the unit square's cells, so many to a side, all that a point within `radius` (cells) of the
// loops' inside lies in.
Mask draw_in_unit(std::vector<Loop> loops, int cells, double radius);

// Every cell that a point within `radius` (cells) of the shape lies in, the shape turned and of
// `scale` cells to its unit. Cost: O(r log r) for r rows that its edges pass
// through, counted per edge, and its height.
Mask draw_shape(const Shape& shape, const Vector2& turn, double scale, double radius);

// The cells of a tile that are taken, and where in it a mask fits.

struct Cell {
  int x = 0;
  int y = 0;
};

class Tile {
 public:
  explicit Tile(int cells);  // to a side

  // Words that lowest() has looked at: a measure of work that is the same everywhere.
  std::uint64_t looked() const { return looked_; }

  // The lowest place, of the lowest ones the leftmost, whose row is in [from, to]: the mask's lower
  // left corner. Cost: a few words per run of the mask and row of the tile.
  std::optional<Cell> lowest(const Mask& mask, int from, int to) const;
  bool fits(const Mask& mask, const Cell& cell) const;
  // Sides of the mask's cells there that a taken cell or the tile's border is beside, as a share of
  // the sides around it. Precondition: it fits.
  double contact(const Mask& mask, const Cell& cell) const;

  void put(const Mask& mask, const Cell& cell);
  void take(const Mask& mask, const Cell& cell);  // what was put there

 private:
  using Word = std::uint64_t;  // 64 cells of a row

  const Word* level(int k, int row) const {
    return &levels_[(at(k) * at(cells_) + at(row)) * at(words_ + 1)];
  }
  int taken(int y, int first, int last) const;  // of these cells of a row; all beyond the tile
  Word* level(int k, int row) { return const_cast<Word*>(std::as_const(*this).level(k, row)); }
  template <typename Change>
  void change(const Mask& mask, const Cell& cell, Change change);
  void widen(int row, int first, int last);  // where level 0 changed in these words

  int cells_;
  int words_;
  int count_;  // levels
  // Level k, row, word (one more, empty): bit x says that one of the cells x .. x + 2^k - 1 is
  // taken.
  std::vector<Word> levels_;
  mutable std::uint64_t looked_ = 0;
};

}  // namespace flipfree::unwrap
