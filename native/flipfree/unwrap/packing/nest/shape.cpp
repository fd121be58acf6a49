#include "flipfree/unwrap/packing/nest/shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include "flipfree/base/lists.h"
#include "flipfree/base/plane.h"

namespace flipfree::unwrap {
namespace {

// The corner strictly between first and last (cyclic) that is farthest from their line.
std::pair<Eigen::Index, double> farthest(const Loop& loop, Eigen::Index first, Eigen::Index last) {
  const Eigen::Index n = loop.rows();
  std::pair<Eigen::Index, double> found{first, -1.0};
  for (Eigen::Index i = first + 1; i < last; ++i) {
    const double d = distance_to_segment(loop.row(i % n), loop.row(first % n), loop.row(last % n));
    if (d > found.second) found = {i, d};
  }
  return found;
}

// The loop with fewer corners, none of its points farther than `tolerance` from it (Douglas and
// Peucker); at least three corners if it has them. Cost: O(n log n) as a rule.
Loop simplified(const Loop& loop, double tolerance) {
  const Eigen::Index n = loop.rows();
  if (n <= 3) return loop;
  // Two corners far apart stay in any case.
  Eigen::Index start = 0, other = 0;
  loop.col(0).minCoeff(&start);
  const double most = (loop.rowwise() - loop.row(start)).rowwise().squaredNorm().maxCoeff(&other);
  if (!(most > 0.0)) return loop.row(start);
  if (other < start) other += n;
  std::vector<Eigen::Index> kept{start, other % n};
  std::vector<std::pair<Eigen::Index, Eigen::Index>> open = {{start, other}, {other, start + n}};
  std::pair<Eigen::Index, double> third{start, -1.0};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const auto [corner, d] = farthest(loop, first, last);
    if (d > tolerance) {
      kept.push_back(corner % n);
      open.emplace_back(first, corner);
      open.emplace_back(corner, last);
    } else if (d > third.second) {
      third = {corner, d};
    }
  }
  if (kept.size() < 3) kept.push_back(third.first % n);
  std::sort(kept.begin(), kept.end());
  return loop(kept, Eigen::all);
}

// Directions modulo a quarter turn, in bins of half a degree; a cross is three of them.
constexpr int kCrossBins = 180;
constexpr double kCrossBin = kQuarterTurn / kCrossBins;

// The cross, two directions at a right angle, along which most of the outlines' length runs: the
// turn that brings it onto the axes, and its share of the length.
struct MainCross {
  Vector2 turn = Vector2::Zero();
  double share = 0.0;
};

MainCross main_cross(const std::vector<Loop>& outlines) {
  std::array<double, kCrossBins> length{};
  std::array<double, kCrossBins>
      moment{};  // length times what the direction is beyond the bin's begin
  double whole = 0.0;
  for (const Loop& loop : outlines) {
    for (Eigen::Index i = 0; i < loop.rows(); ++i) {
      const Vector2 side = loop.row((i + 1) % loop.rows()) - loop.row(i);
      const double own = side.norm();
      if (!(own > 0.0)) continue;
      const double angle =
          std::fmod(std::atan2(side.y(), side.x()) + 4.0 * kQuarterTurn, kQuarterTurn);
      const int bin = std::min(static_cast<int>(angle / kCrossBin), kCrossBins - 1);
      length[at(bin)] += own;
      moment[at(bin)] += own * (angle - bin * kCrossBin);
      whole += own;
    }
  }
  MainCross best;
  for (int i = 0; i < kCrossBins; ++i) {
    const std::size_t before = at((i + kCrossBins - 1) % kCrossBins);
    const std::size_t after = at((i + 1) % kCrossBins);
    const double own = length[before] + length[at(i)] + length[after];
    // Of equal ones the first, which is as it lies.
    if (!(own > (1.0 + 1e-9) * best.share * whole)) continue;
    const double mean = (moment[before] - kCrossBin * length[before] + moment[at(i)] +
                         moment[after] + kCrossBin * length[after]) /
                        own;
    double angle = i * kCrossBin + mean;
    if (angle > 0.5 * kQuarterTurn) angle -= kQuarterTurn;
    best = {{std::cos(angle), -std::sin(angle)}, own / whole};
  }
  return best;
}

// A polygon of 24 sides has a sixth.
constexpr double kStraight = 0.25;
// Of the least width over the largest.
constexpr double kRound = 0.95;

}  // namespace

void Spans::add(const Vector2& p) {
  static const std::array<Vector2, kDirections> directions = [] {
    std::array<Vector2, kDirections> all;
    for (std::size_t k = 0; k < kDirections; ++k) {
      const double angle = std::numbers::pi * static_cast<double>(k) / kDirections;
      all[k] = {std::cos(angle), std::sin(angle)};
    }
    return all;
  }();
  for (std::size_t i = 0; i < kDirections; ++i) spans_[i].add(directions[i].dot(p));
}

double Spans::length() const {
  std::size_t narrowest = 0;
  for (std::size_t i = 1; i < kDirections; ++i)
    if (width(i) < width(narrowest)) narrowest = i;
  return width((narrowest + kDirections / 2) % kDirections);
}

double Spans::roundness() const {
  Span widths;
  for (std::size_t i = 0; i < kDirections; ++i) widths.add(width(i));
  return widths.low / widths.high;
}

Vector2 straight_axis(const std::vector<Loop>& outlines) {
  const MainCross cross = main_cross(outlines);
  if (cross.share > kStraight) return cross.turn;
  Spans spans;
  for (const Loop& loop : outlines)
    for (const auto p : loop.rowwise()) spans.add(p);
  return spans.roundness() > kRound ? cross.turn : Vector2::Zero();
}

Loop triangle_of(const Points2& corners, Eigen::Index i) {
  Loop loop = corners.middleRows(i, 3);
  if (twice_area(loop.row(0), loop.row(1), loop.row(2)) < 0.0) loop.row(1).swap(loop.row(2));
  return loop;
}

Eigen::AlignedBox2d box_of(const std::vector<Loop>& loops, const Vector2& turn) {
  Eigen::AlignedBox2d box;
  for (const Loop& loop : loops) box.extend(bounds_of(moved({turn, Vector2::Zero()}, loop)));
  return box;
}

Shape make_shape(const std::vector<Loop>& outlines, double tolerance, Vector2& middle) {
  const Eigen::AlignedBox2d box = box_of(outlines);
  middle = 0.5 * (box.min() + box.max());
  const Vector2 turn = straight_axis(outlines);
  Shape shape;
  shape.slack = tolerance;
  // Bins that begin elsewhere have another mean.
  shape.upright = turn.x() > 0.0 && std::abs(turn.y()) < kCrossBin;
  for (const Loop& outline : outlines) {
    const Loop& loop =
        shape.loops.emplace_back(simplified(outline, tolerance).rowwise() - middle.transpose());
    shape.radius = std::max(shape.radius, loop.rowwise().norm().maxCoeff());
    for (Eigen::Index i = 0; i < outline.rows(); ++i) {
      const Vector2 a = outline.row(i).transpose() - middle;
      const Vector2 b = outline.row((i + 1) % outline.rows()).transpose() - middle;
      shape.area += 0.5 * cross(a, b);
    }
  }
  return shape;
}

Vector2 squarest_turn(const Shape& shape) {
  constexpr int kTurns = 360;
  double least = std::numeric_limits<double>::infinity();
  Vector2 best(1.0, 0.0);
  for (int i = 0; i < kTurns; ++i) {
    const double angle = kQuarterTurn * i / kTurns;
    const Vector2 turn(std::cos(angle), std::sin(angle));
    const double side = box_of(shape.loops, turn).sizes().maxCoeff();
    if (!(side < least)) continue;
    least = side;
    best = turn;
  }
  return best;
}

namespace {

// Against rounding of what touches a cell's edge, in cells.
constexpr double kTouchingCare = 1e-9;

// The right border of the points within `radius` of a segment: at a side parallel to it, or around
// the end beyond that.
struct RightBorder {
  Vector2 low, high;  // the ends
  double radius;
  Vector2 side = high - low;
  Vector2 begin = low + Vector2(side.y(), -side.x()) * (radius / std::max(side.norm(), 1e-300));

  // The largest x where y is in [bottom, top], where some of the points are: they are convex.
  double largest(double bottom, double top) const {
    const double y = std::clamp(low.x() > high.x() ? low.y() : high.y(), bottom, top);
    const double rise = y - begin.y();
    if (rise > 0.0 && rise < side.y()) return begin.x() + side.x() / side.y() * rise;
    const Vector2& end = rise <= 0.0 ? low : high;
    return end.x() + std::sqrt(std::max(0.0, radius * radius - (y - end.y()) * (y - end.y())));
  }
};

// Cells as they are drawn, in any order: a row's from the first to the last.
struct Drawing {
  int width, height;
  std::vector<std::pair<int, Run>> runs = {};

  // The cells of a row from x = first to x = last that the drawing has.
  void add(int row, double first, double last) {
    const Run run{static_cast<int>(std::clamp(std::floor(first), 0.0, width + 0.0)),
                  static_cast<int>(std::clamp(std::floor(last), -1.0, width - 1.0))};
    if (run.first <= run.last) runs.emplace_back(row, run);
  }

  Mask mask() const {
    Lists<Run> rows(at(height), [&](const auto& add) {
      for (const auto& [row, run] : runs) add(row, run);
    });
    Mask mask{width, height, {0}};
    for (int row = 0; row < height; ++row) {
      std::sort(rows[row].begin(), rows[row].end(),
                [](const Run& a, const Run& b) { return a.first < b.first; });
      const std::size_t begin = mask.runs.size();
      for (const Run& run : rows[row]) {
        if (mask.runs.size() > begin && run.first <= mask.runs.back().last + 1) {
          mask.runs.back().last = std::max(mask.runs.back().last, run.last);
        } else {
          mask.runs.push_back(run);
        }
      }
      mask.row_begin.push_back(static_cast<int>(mask.runs.size()));
    }
    return mask;
  }
};

// Where an outline crosses the middle of a row.
struct Crossing {
  int row;
  int way;  // upwards 1, downwards -1
  double x;
};

// The inside of the loops at the rows' middles; cells that only touch it are the outline's.
void draw_inside(const std::vector<Loop>& loops, Drawing& drawing) {
  std::vector<Crossing> crossings;
  for (const Loop& loop : loops) {
    for (Eigen::Index i = 0; i < loop.rows(); ++i) {
      Vector2 a = loop.row(i);
      Vector2 b = loop.row((i + 1) % loop.rows());
      const int way = a.y() < b.y() ? 1 : -1;
      if (way < 0) std::swap(a, b);
      const double height = drawing.height;
      const int first = static_cast<int>(std::clamp(std::ceil(a.y() - 0.5), 0.0, height));
      const int last =
          static_cast<int>(std::clamp(std::ceil(b.y() - 0.5) - 1.0, -1.0, height - 1.0));
      if (first > last) continue;
      const double slope = (b.x() - a.x()) / (b.y() - a.y());
      for (int row = first; row <= last; ++row)
        crossings.push_back({row, way, a.x() + slope * (row + 0.5 - a.y())});
    }
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.row, a.x, a.way) < std::tie(b.row, b.x, b.way);
  });
  int winding = 0;
  for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
    const Crossing& from = crossings[i];
    const Crossing& to = crossings[i + 1];
    winding = from.row == to.row ? winding + from.way : 0;
    if (winding != 0) drawing.add(from.row, from.x, to.x);
  }
}

// Every cell that a point within `radius` of the segment lies in. All in cells.
void draw_segment(const Vector2& a, const Vector2& b, double radius, Drawing& drawing) {
  const double reach = radius + kTouchingCare;
  const Vector2 &low = a.y() < b.y() ? a : b, &high = a.y() < b.y() ? b : a;
  const RightBorder right{low, high, reach};
  const RightBorder left{{-low.x(), low.y()}, {-high.x(), high.y()}, reach};
  const double bottom = low.y() - reach, top = high.y() + reach;
  const int first = static_cast<int>(std::clamp(std::floor(bottom), 0.0, drawing.height + 0.0));
  const int last = static_cast<int>(std::clamp(std::floor(top), -1.0, drawing.height - 1.0));
  for (int row = first; row <= last; ++row) {
    const double from = std::max(bottom, row + 0.0), to = std::min(top, row + 1.0);
    drawing.add(row, -left.largest(from, to), right.largest(from, to));
  }
}

Mask drawn(const std::vector<Loop>& loops, double radius, int width, int height) {
  Drawing drawing{width, height};
  draw_inside(loops, drawing);
  for (const Loop& loop : loops) {
    for (Eigen::Index i = 0; i < loop.rows(); ++i)
      draw_segment(loop.row(i), loop.row((i + 1) % loop.rows()), radius, drawing);
  }
  return drawing.mask();
}

}  // namespace

Mask draw_in_unit(std::vector<Loop> loops, int cells, double radius) {
  for (Loop& loop : loops) loop *= cells;
  return drawn(loops, radius, cells, cells);
}

Mask draw_shape(const Shape& shape, const Vector2& turn, double scale, double radius) {
  Eigen::AlignedBox2d box;
  std::vector<Loop> loops;
  for (const Loop& loop : shape.loops)
    box.extend(bounds_of(loops.emplace_back(moved({scale * turn, Vector2::Zero()}, loop))));
  const Vector2 care = Vector2::Constant(radius + 2.0 * kTouchingCare);
  const Vector2 origin = care - box.min();
  for (Loop& loop : loops) loop.rowwise() += origin.transpose();
  const Vector2 size = (box.sizes() + 2.0 * care).array().ceil().max(1.0);
  Mask mask = drawn(loops, radius, static_cast<int>(size.x()), static_cast<int>(size.y()));
  mask.origin = origin;
  return mask;
}

namespace {

constexpr int kMostWords = 128;  // tiles of at most 8192 cells

// Powers of two up to `cells`. What the library's function returns differs between its versions.
int levels_of(int cells) { return static_cast<int>(std::bit_width(static_cast<unsigned>(cells))); }

// Word w of a row shifted to lower cells by `by`; the row has an empty word more.
std::uint64_t shifted(const std::uint64_t* row, int by, int w) {
  const int i = w + by / 64;
  const int bits = by % 64;
  return (row[i] >> bits) | (row[i + 1] << 1 << (63 - bits));
}

// Of the cells [first, last] of a row those in word w.
std::uint64_t word_of(int w, int first, int last) {
  std::uint64_t word = ~std::uint64_t{0};
  if (w == first / 64) word <<= first % 64;
  if (w == last / 64) word &= ~std::uint64_t{0} >> (63 - last % 64);
  return word;
}

}  // namespace

Tile::Tile(int cells) : cells_(cells), words_((cells + 63) / 64), count_(levels_of(cells)) {
  levels_.assign(at(count_) * at(cells_) * at(words_ + 1), 0);
}

void Tile::widen(int row, int first, int last) {
  for (int k = 1; k < count_; ++k) {
    const Word* from = level(k - 1, row);
    Word* into = level(k, row);
    const int step = 1 << (k - 1);
    // A level's cell looks as far to the right as its runs are long.
    const int begin = std::max(0, first - (2 * step + 63) / 64);
    const int inside = std::min(last + 1, words_ - step / 64);
    for (int w = begin; w < inside; ++w) into[w] = from[w] | shifted(from, step, w);
    for (int w = std::max(begin, inside); w <= last; ++w) into[w] = from[w];
  }
}

std::optional<Cell> Tile::lowest(const Mask& mask, int from, int to) const {
  const int last_x = cells_ - mask.width;
  const int last_y = std::min(to, cells_ - mask.height);
  if (last_x < 0 || mask.height > cells_) return std::nullopt;
  const int words = last_x / 64 + 1;
  std::array<Word, kMostWords> blocked;
  std::uint64_t rows = 0;
  for (int y = std::max(0, from); y <= last_y; ++y) {
    std::fill_n(blocked.begin(), words, 0);
    if (last_x % 64 != 63) blocked[at(words - 1)] = ~Word{0} << (last_x % 64 + 1);
    // Rows in an order that soon meets what is in the way: from the middle on, far steps first.
    bool all = false;
    constexpr int kStride = 5;
    const int half = mask.height / 2;
    for (int phase = 0; phase < kStride && !all; ++phase) {
      for (int i = phase; i < mask.height && !all; i += kStride) {
        const int j = i + half < mask.height ? i + half : i + half - mask.height;
        for (const Run& run : mask.row(j)) {
          const int k = levels_of(run.last - run.first + 1) - 1;
          const Word* row = level(k, y + j);
          for (const int by : {run.first, run.last + 1 - (1 << k)}) {
            const int inside = std::min(words, words_ - by / 64);
            for (int w = 0; w < inside; ++w) blocked[at(w)] |= shifted(row, by, w);
            if (run.first == run.last + 1 - (1 << k)) break;  // both are one
          }
        }
        ++rows;
        Word free = 0;
        for (int w = 0; w < words; ++w) free |= ~blocked[at(w)];
        all = free == 0;
      }
    }
    if (all) continue;
    for (int w = 0; w < words; ++w) {
      const Word free = ~blocked[at(w)];
      if (free == 0) continue;
      looked_ += rows * static_cast<std::uint64_t>(words);
      return Cell{64 * w + std::countr_zero(free), y};
    }
  }
  looked_ += rows * static_cast<std::uint64_t>(words);
  return std::nullopt;
}

bool Tile::fits(const Mask& mask, const Cell& cell) const {
  if (cell.x < 0 || cell.y < 0 || cell.x + mask.width > cells_ || cell.y + mask.height > cells_)
    return false;
  for (int j = 0; j < mask.height; ++j) {
    for (const Run& run : mask.row(j)) {
      const int k = levels_of(run.last - run.first + 1) - 1;
      for (const int x : {cell.x + run.first, cell.x + run.last + 1 - (1 << k)})
        if (((level(k, cell.y + j)[x / 64] >> (x % 64)) & 1) != 0) return false;
    }
  }
  return true;
}

int Tile::taken(int y, int first, int last) const {
  if (y < 0 || y >= cells_ || first < 0 || last >= cells_) return last - first + 1;
  int count = 0;
  for (int w = first / 64; w <= last / 64; ++w)
    count += std::popcount(level(0, y)[w] & word_of(w, first, last));
  return count;
}

double Tile::contact(const Mask& mask, const Cell& cell) const {
  int touched = 0;
  for (int j = 0; j < mask.height; ++j) {
    const int y = cell.y + j;
    for (const Run& run : mask.row(j)) {
      const int first = cell.x + run.first;
      const int last = cell.x + run.last;
      // Where the mask fits, no cell of its own is taken.
      touched += taken(y, first - 1, first - 1) + taken(y, last + 1, last + 1) +
                 taken(y - 1, first, last) + taken(y + 1, first, last);
    }
  }
  return 0.5 * touched / static_cast<double>(mask.width + static_cast<int>(mask.runs.size()));
}

template <typename Change>
void Tile::change(const Mask& mask, const Cell& cell, Change change) {
  for (int j = 0; j < mask.height; ++j) {
    Word* row = level(0, cell.y + j);
    for (const Run& run : mask.row(j)) {
      const int first = cell.x + run.first;
      const int last = cell.x + run.last;
      for (int w = first / 64; w <= last / 64; ++w) change(row[w], word_of(w, first, last));
    }
    widen(cell.y + j, cell.x / 64, (cell.x + mask.width - 1) / 64);
  }
}

void Tile::put(const Mask& mask, const Cell& cell) {
  change(mask, cell, [](Word& word, Word own) { word |= own; });
}

void Tile::take(const Mask& mask, const Cell& cell) {
  change(mask, cell, [](Word& word, Word own) { word &= ~own; });
}

}  // namespace flipfree::unwrap
