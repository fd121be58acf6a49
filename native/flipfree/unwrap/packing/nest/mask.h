// Shapes as cells of a grid, 64 to a word.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {

using Word = std::uint64_t;

// The x of what lies in a row.
struct Span {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

// Cells from `first` to `last` of a row, both included.
struct Run {
  int first = 0;
  int last = 0;
};

struct Mask {
  int width = 0;   // cells
  int height = 0;  // rows
  int words = 0;   // per row
  std::vector<Word> bits;
  std::vector<int> row_begin;  // height + 1: the runs of each row
  std::vector<Run> runs;
  // The cells around the mask that share a side with one of it: from one cell left of it and below
  // on, ring_words words for each of height + 2 rows.
  int ring_words = 0;
  int ring_cells = 0;
  std::vector<Word> ring;
  Vector2 origin = Vector2::Zero();  // of the item from the mask's lower left corner, in cells
  bool empty() const { return height == 0; }
};

// Sets the cells [first, last] of a row, cut to the row's `width`.
void set_cells(Word* row, int width, double first, double last);

// Sets, in a grid of so many cells with its corner at the origin, every cell that a point within
// `radius` of the segment lies in. All in cells.
void draw_segment(const Vector2& a, const Vector2& b, double radius, int width, int height,
                  int words, std::vector<Word>& bits);

// Sets, in such a grid of `cells` to the unit, every cell that a point within `radius` (cells) of
// the loop's inside lies in.
void draw_loop(const Loop& loop, int cells, double radius, int words, std::vector<Word>& bits);

// Memory of drawing, for one shape after another.
struct Pen {
  struct Crossing {
    int row;
    int way;  // upwards 1, downwards -1
    double x;
  };
  std::vector<Vector2> points;     // of all loops
  std::vector<std::size_t> begin;  // of each loop, and the end
  std::vector<Crossing> crossings;
  std::vector<Word> ring;
};

// Every cell that a point within `radius` (cells) of the shape lies in, the shape turned and of
// `scale` cells to its unit. Cost: O(rows that its edges pass through + cells / 64).
Mask draw_shape(const Shape& shape, const Vector2& turn, double scale, double radius, Pen& pen);

}  // namespace flipfree::unwrap
