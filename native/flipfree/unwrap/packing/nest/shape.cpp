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

#include "flipfree/base/plane.h"

namespace flipfree::unwrap {
namespace {

// The corner strictly between first and last (cyclic) that is farthest from their line.
std::pair<std::size_t, double> farthest(const Loop& loop, std::size_t first, std::size_t last) {
  const std::size_t n = loop.size();
  std::pair<std::size_t, double> found{first, -1.0};
  for (std::size_t i = first + 1; i < last; ++i) {
    const double d = distance_to_segment(loop[i % n], loop[first % n], loop[last % n]);
    if (d > found.second) found = {i, d};
  }
  return found;
}

// The loop with fewer corners, none of its points farther than `tolerance` from it (Douglas and
// Peucker); at least three corners if it has them. Cost: O(n log n) as a rule.
Loop simplified(const Loop& loop, double tolerance) {
  const std::size_t n = loop.size();
  if (n <= 3) return loop;
  // Two corners far apart stay in any case.
  std::size_t start = 0;
  for (std::size_t i = 1; i < n; ++i) {
    if (loop[i].x() < loop[start].x()) start = i;
  }
  std::size_t other = start;
  for (std::size_t i = 0; i < n; ++i) {
    if ((loop[i] - loop[start]).squaredNorm() > (loop[other] - loop[start]).squaredNorm())
      other = i;
  }
  if (other == start) return {loop[start]};
  if (other < start) other += n;
  std::vector<char> kept(n, 0);
  kept[start] = kept[other % n] = 1;
  std::vector<std::pair<std::size_t, std::size_t>> open = {{start, other}, {other, start + n}};
  std::pair<std::size_t, double> third{start, -1.0};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const auto [corner, d] = farthest(loop, first, last);
    if (d > tolerance) {
      kept[corner % n] = 1;
      open.emplace_back(first, corner);
      open.emplace_back(corner, last);
    } else if (d > third.second) {
      third = {corner, d};
    }
  }
  if (std::count(kept.begin(), kept.end(), 1) < 3) kept[third.first % n] = 1;
  Loop result;
  for (std::size_t i = 0; i < n; ++i)
    if (kept[i] != 0) result.push_back(loop[i]);
  return result;
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
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2 side = loop[(i + 1) % loop.size()] - loop[i];
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
    for (const Vector2& p : loop) spans.add(p);
  return spans.roundness() > kRound ? cross.turn : Vector2::Zero();
}

Loop triangle_of(const Points2& corners, Eigen::Index i) {
  Loop loop;
  for (Eigen::Index k = 0; k < 3; ++k) loop.push_back(corners.row(i + k).transpose());
  if (twice_area(loop[0], loop[1], loop[2]) < 0.0) std::swap(loop[1], loop[2]);
  return loop;
}

Shape make_shape(const std::vector<Loop>& outlines, double tolerance, Vector2& middle) {
  Eigen::AlignedBox2d box;
  for (const Loop& loop : outlines)
    for (const Vector2& p : loop) box.extend(p);
  middle = 0.5 * (box.min() + box.max());
  const Vector2 turn = straight_axis(outlines);
  Shape shape;
  shape.slack = tolerance;
  // Bins that begin elsewhere have another mean.
  shape.upright = turn.x() > 0.0 && std::abs(turn.y()) < kCrossBin;
  for (const Loop& outline : outlines) {
    Loop loop = simplified(outline, tolerance);
    for (Vector2& p : loop) {
      p -= middle;
      shape.radius = std::max(shape.radius, p.norm());
    }
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vector2 a = outline[i] - middle;
      const Vector2 b = outline[(i + 1) % outline.size()] - middle;
      shape.area += 0.5 * cross(a, b);
    }
    shape.loops.push_back(std::move(loop));
  }
  return shape;
}

Vector2 squarest_turn(const Shape& shape) {
  constexpr int kTurns = 360;
  double least = std::numeric_limits<double>::infinity();
  Vector2 best(1.0, 0.0);
  for (int i = 0; i < kTurns; ++i) {
    const double angle = kQuarterTurn * i / kTurns;
    const Pose pose{Vector2::Zero(), {std::cos(angle), std::sin(angle)}};
    Eigen::AlignedBox2d box;
    for (const Loop& loop : shape.loops)
      for (const Vector2& p : loop) box.extend(pose(p, 1.0));
    if (!(box.sizes().maxCoeff() < least)) continue;
    least = box.sizes().maxCoeff();
    best = pose.turn;
  }
  return best;
}

namespace {

// Against rounding of what touches a cell's edge, in cells.
constexpr double kTouchingCare = 1e-9;

// The x of the disc's points with y in [bottom, bottom + 1].
void add_disc(const Vector2& p, double radius, double bottom, Span& span) {
  const double off = std::max({0.0, bottom - p.y(), p.y() - bottom - 1.0});
  if (off > radius) return;
  const double half = std::sqrt(radius * radius - off * off);
  span.add(p.x() - half);
  span.add(p.x() + half);
}

// A side of a strip: from its lower end to its upper one.
struct StripSide {
  Vector2 low, high;
  double slope;  // of x by y

  StripSide(const Vector2& a, const Vector2& b)
      : low(a.y() <= b.y() ? a : b), high(a.y() <= b.y() ? b : a) {
    const double rise = high.y() - low.y();
    slope = rise < 1e-12 ? 0.0 : (high.x() - low.x()) / rise;
  }

  // Its points with y in [bottom, bottom + 1].
  void add(double bottom, Span& span) const {
    if (low.y() > bottom + 1.0 || high.y() < bottom) return;
    const bool begins = low.y() >= bottom;
    const bool ends = high.y() <= bottom + 1.0;
    span.add(begins ? low.x() : low.x() + slope * (bottom - low.y()));
    span.add(ends ? high.x() : low.x() + slope * (bottom + 1.0 - low.y()));
  }
};

// Of the cells [first, last] of a row those in word w.
Word word_of(int w, int first, int last) {
  Word word = ~Word{0};
  if (w == first / 64) word <<= first % 64;
  if (w == last / 64) word &= ~Word{0} >> (63 - last % 64);
  return word;
}

// Sets the cells [first, last] of a row, cut to the row's `width`.
void set_cells(Word* row, int width, double first, double last) {
  const int a = static_cast<int>(std::clamp(std::floor(first), 0.0, static_cast<double>(width)));
  const int b = static_cast<int>(std::clamp(std::floor(last), -1.0, width - 1.0));
  if (a > b) return;
  for (int w = a / 64; w <= b / 64; ++w) row[w] |= word_of(w, a, b);
}

// Where an outline crosses the middle of a row.
struct Crossing {
  int row;
  int way;  // upwards 1, downwards -1
  double x;
};

// The inside of the loops at the rows' middles; cells that only touch it are the outline's.
void draw_inside(const std::vector<Loop>& loops, int width, int height, int words,
                 std::vector<Word>& bits) {
  std::vector<Crossing> crossings;
  for (const Loop& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      Vector2 a = loop[i];
      Vector2 b = loop[(i + 1) % loop.size()];
      const int way = a.y() < b.y() ? 1 : -1;
      if (way < 0) std::swap(a, b);
      const int first = static_cast<int>(std::clamp(std::ceil(a.y() - 0.5), 0.0, height + 0.0));
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
    if (winding != 0) set_cells(&bits[at(from.row * words)], width, from.x, to.x);
  }
}

// Sets, in a grid of so many cells with its corner at the origin, every cell that a point within
// `radius` of the segment lies in. All in cells.
void draw_segment(const Vector2& a, const Vector2& b, double radius, int width, int height,
                  int words, std::vector<Word>& bits) {
  const double reach = radius + kTouchingCare;
  const auto row_of = [&](double y) {
    return static_cast<int>(std::clamp(std::floor(y), -1.0, static_cast<double>(height)));
  };
  const int first = std::max(0, row_of(std::min(a.y(), b.y()) - reach));
  const int last = std::min(height - 1, row_of(std::max(a.y(), b.y()) + reach));
  const Vector2 side = b - a;
  const double length = side.norm();
  const Vector2 off =
      length > 0.0 ? Vector2(-side.y(), side.x()) * (reach / length) : Vector2(0.0, 0.0);
  // The strip's ends are within the discs.
  const StripSide left(a + off, b + off);
  const StripSide right(a - off, b - off);
  for (int row = first; row <= last; ++row) {
    Span span;
    add_disc(a, reach, row, span);
    add_disc(b, reach, row, span);
    if (length > 0.0) {
      left.add(row, span);
      right.add(row, span);
    }
    if (span.low <= span.high) set_cells(&bits[at(row * words)], width, span.low, span.high);
  }
}

void draw(const std::vector<Loop>& loops, double radius, int width, int height, int words,
          std::vector<Word>& bits) {
  draw_inside(loops, width, height, words, bits);
  for (const Loop& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i)
      draw_segment(loop[i], loop[(i + 1) % loop.size()], radius, width, height, words, bits);
  }
}

// The first cell of a row from x on that is set, or that is not; `end` if there is none.
int next_cell(const Word* row, int x, int end, bool is_set) {
  for (; x < end; x = (x / 64 + 1) * 64) {
    const Word word = (is_set ? row[x / 64] : ~row[x / 64]) >> (x % 64);
    if (word != 0) return x + std::countr_zero(word);
  }
  return end;
}

void find_runs(Mask& mask) {
  mask.row_begin.assign(1, 0);
  mask.runs.reserve(at(mask.height));
  const int end = 64 * mask.words;
  for (int j = 0; j < mask.height; ++j) {
    const Word* row = &mask.bits[at(j * mask.words)];
    for (int x = next_cell(row, 0, end, true); x < end;) {
      const int beyond = next_cell(row, x, end, false);
      mask.runs.push_back({x, beyond - 1});
      x = next_cell(row, beyond, end, true);
    }
    mask.row_begin.push_back(static_cast<int>(mask.runs.size()));
  }
}

}  // namespace

void draw_loop(Loop loop, int cells, double radius, int words, std::vector<Word>& bits) {
  for (Vector2& p : loop) p *= cells;
  draw({std::move(loop)}, radius, cells, cells, words, bits);
}

Mask draw_shape(const Shape& shape, const Vector2& turn, double scale, double radius) {
  Eigen::AlignedBox2d box;
  const Pose pose{Vector2::Zero(), turn};
  std::vector<Loop> loops = shape.loops;
  for (Loop& loop : loops) {
    for (Vector2& p : loop) {
      p = pose(p, scale);
      box.extend(p);
    }
  }
  Mask mask;
  const Vector2 care = Vector2::Constant(radius + 2.0 * kTouchingCare);
  mask.origin = care - box.min();
  const Vector2 size = box.sizes() + 2.0 * care;
  mask.width = std::max(1, static_cast<int>(std::ceil(size.x())));
  mask.height = std::max(1, static_cast<int>(std::ceil(size.y())));
  mask.words = (mask.width + 63) / 64;
  mask.bits.assign(at(mask.words) * at(mask.height), 0);
  for (Loop& loop : loops)
    for (Vector2& p : loop) p += mask.origin;
  draw(loops, radius, mask.width, mask.height, mask.words, mask.bits);
  find_runs(mask);
  return mask;
}

namespace {

constexpr int kMostWords = 128;  // tiles of at most 8192 cells

// Powers of two up to `cells`. What the library's function returns differs between its versions.
int levels_of(int cells) { return static_cast<int>(std::bit_width(static_cast<unsigned>(cells))); }

// Word w of a row shifted to lower cells by `by`; the row has an empty word more.
Word shifted(const Word* row, int by, int w) {
  const int i = w + by / 64;
  const int bits = by % 64;
  return (row[i] >> bits) | (row[i + 1] << 1 << (63 - bits));
}

}  // namespace

Tile::Tile(int cells) : cells_(cells), words_((cells + 63) / 64), count_(levels_of(cells)) {
  levels_.assign(at(count_) * at(cells_) * at(words_ + 1), 0);
}

Tile::Tile(int cells, const std::vector<Word>& taken) : Tile(cells) {
  for (int row = 0; row < cells_; ++row) {
    std::copy_n(taken.begin() + static_cast<std::ptrdiff_t>(row) * words_, words_, level(0, row));
    widen(row, 0, words_ - 1);
  }
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
  const int skip = cell.x / 64;
  const int bits = cell.x % 64;
  for (int j = 0; j < mask.height; ++j) {
    Word* row = level(0, cell.y + j);
    const Word* own = &mask.bits[at(j * mask.words)];
    for (int w = 0; w < mask.words; ++w) {
      change(row[w + skip], own[w] << bits);
      if (bits != 0 && w + skip + 1 < words_) change(row[w + skip + 1], own[w] >> (64 - bits));
    }
    const int last = bits != 0 ? std::min(skip + mask.words, words_ - 1) : skip + mask.words - 1;
    widen(cell.y + j, skip, last);
  }
}

void Tile::put(const Mask& mask, const Cell& cell) {
  change(mask, cell, [](Word& word, Word own) { word |= own; });
}

void Tile::take(const Mask& mask, const Cell& cell) {
  change(mask, cell, [](Word& word, Word own) { word &= ~own; });
}

}  // namespace flipfree::unwrap
