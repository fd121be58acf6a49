#include "flipfree/unwrap/packing/nest/mask.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace flipfree::unwrap {
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

// The inside of the loops at the rows' middles; cells that only touch it are the outline's.
void draw_inside(Pen& pen, int width, int height, int words, std::vector<Word>& bits) {
  pen.crossings.clear();
  for (std::size_t l = 0; l + 1 < pen.begin.size(); ++l) {
    const std::size_t end = pen.begin[l + 1];
    for (std::size_t i = pen.begin[l]; i < end; ++i) {
      Vector2 a = pen.points[i];
      Vector2 b = pen.points[i + 1 < end ? i + 1 : pen.begin[l]];
      const int way = a.y() < b.y() ? 1 : -1;
      if (way < 0) std::swap(a, b);
      const int first = static_cast<int>(std::clamp(std::ceil(a.y() - 0.5), 0.0, height + 0.0));
      const int last =
          static_cast<int>(std::clamp(std::ceil(b.y() - 0.5) - 1.0, -1.0, height - 1.0));
      if (first > last) continue;
      const double slope = (b.x() - a.x()) / (b.y() - a.y());
      for (int row = first; row <= last; ++row)
        pen.crossings.push_back({row, way, a.x() + slope * (row + 0.5 - a.y())});
    }
  }
  std::sort(pen.crossings.begin(), pen.crossings.end(), [](const auto& a, const auto& b) {
    return a.row != b.row ? a.row < b.row : (a.x != b.x ? a.x < b.x : a.way < b.way);
  });
  int winding = 0;
  for (std::size_t i = 0; i + 1 < pen.crossings.size(); ++i) {
    const Pen::Crossing& from = pen.crossings[i];
    const Pen::Crossing& to = pen.crossings[i + 1];
    winding = from.row == to.row ? winding + from.way : 0;
    if (winding != 0)
      set_cells(&bits[static_cast<std::size_t>(from.row * words)], width, from.x, to.x);
  }
}

void draw_outlines(const Pen& pen, double radius, int width, int height, int words,
                   std::vector<Word>& bits) {
  for (std::size_t l = 0; l + 1 < pen.begin.size(); ++l) {
    const std::size_t end = pen.begin[l + 1];
    for (std::size_t i = pen.begin[l]; i < end; ++i)
      draw_segment(pen.points[i], pen.points[i + 1 < end ? i + 1 : pen.begin[l]], radius, width,
                   height, words, bits);
  }
}

void find_runs(Mask& mask) {
  mask.row_begin.reserve(static_cast<std::size_t>(mask.height) + 1);
  mask.row_begin.assign(1, 0);
  mask.runs.reserve(static_cast<std::size_t>(mask.height));
  for (int row = 0; row < mask.height; ++row) {
    const Word* bits = &mask.bits[static_cast<std::size_t>(row * mask.words)];
    int x = 0;
    const int end = 64 * mask.words;
    while (x < end) {
      const Word ones = bits[x / 64] >> (x % 64);
      if (ones == 0) {
        x = (x / 64 + 1) * 64;
        continue;
      }
      const int first = x + std::countr_zero(ones);
      x = first;
      while (x < end) {
        const Word zeros = ~bits[x / 64] >> (x % 64);
        if (zeros != 0) {
          x += std::countr_zero(zeros);
          break;
        }
        x = (x / 64 + 1) * 64;
      }
      mask.runs.push_back({first, std::min(x, end) - 1});
    }
    mask.row_begin.push_back(static_cast<int>(mask.runs.size()));
  }
}

void find_ring(Mask& mask, std::vector<Word>& own) {
  mask.ring_words = (mask.width + 2 + 63) / 64;
  const auto words = static_cast<std::size_t>(mask.ring_words);
  const auto rows = static_cast<std::size_t>(mask.height) + 2;
  // The mask itself, one cell further right and up.
  own.assign(words * rows, 0);
  for (std::size_t j = 0; j + 2 < rows; ++j) {
    const Word* from = &mask.bits[j * static_cast<std::size_t>(mask.words)];
    Word* into = &own[(j + 1) * words];
    for (std::size_t w = 0; w < static_cast<std::size_t>(mask.words); ++w) {
      into[w] |= from[w] << 1;
      if (w + 1 < words) into[w + 1] |= from[w] >> 63;
    }
  }
  mask.ring.assign(words * rows, 0);
  mask.ring_cells = 0;
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t w = 0; w < words; ++w) {
      const std::size_t i = j * words + w;
      Word beside = (own[i] << 1) | (own[i] >> 1);
      if (w > 0) beside |= own[i - 1] >> 63;
      if (w + 1 < words) beside |= own[i + 1] << 63;
      if (j > 0) beside |= own[i - words];
      if (j + 1 < rows) beside |= own[i + words];
      mask.ring[i] = beside & ~own[i];
      mask.ring_cells += std::popcount(mask.ring[i]);
    }
  }
}

}  // namespace

void set_cells(Word* row, int width, double first, double last) {
  const int a = static_cast<int>(std::clamp(std::floor(first), 0.0, static_cast<double>(width)));
  const int b = static_cast<int>(std::clamp(std::floor(last), -1.0, width - 1.0));
  if (a > b) return;
  const Word head = ~Word{0} << (a % 64);
  const Word tail = ~Word{0} >> (63 - b % 64);
  if (a / 64 == b / 64) {
    row[a / 64] |= head & tail;
    return;
  }
  row[a / 64] |= head;
  for (int w = a / 64 + 1; w < b / 64; ++w) row[w] = ~Word{0};
  row[b / 64] |= tail;
}

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
    if (span.low <= span.high)
      set_cells(&bits[static_cast<std::size_t>(row * words)], width, span.low, span.high);
  }
}

void draw_loop(const Loop& loop, int cells, double radius, int words, std::vector<Word>& bits) {
  Pen pen;
  pen.points = loop;
  for (Vector2& p : pen.points) p *= cells;
  pen.begin = {0, loop.size()};
  draw_inside(pen, cells, cells, words, bits);
  draw_outlines(pen, radius, cells, cells, words, bits);
}

Mask draw_shape(const Shape& shape, const Vector2& turn, double scale, double radius, Pen& pen) {
  Vector2 low = Vector2::Constant(std::numeric_limits<double>::infinity());
  Vector2 high = -low;
  const Pose pose{Vector2::Zero(), turn};
  pen.points.clear();
  pen.begin.assign(1, 0);
  for (const Loop& loop : shape.loops) {
    for (const Vector2& p : loop) {
      pen.points.push_back(pose(p, scale));
      low = low.cwiseMin(pen.points.back());
      high = high.cwiseMax(pen.points.back());
    }
    pen.begin.push_back(pen.points.size());
  }
  Mask mask;
  const Vector2 care = Vector2::Constant(radius + 2.0 * kTouchingCare);
  mask.origin = care - low;
  const Vector2 size = high - low + 2.0 * care;
  mask.width = std::max(1, static_cast<int>(std::ceil(size.x())));
  mask.height = std::max(1, static_cast<int>(std::ceil(size.y())));
  mask.words = (mask.width + 63) / 64;
  mask.bits.assign(static_cast<std::size_t>(mask.words) * static_cast<std::size_t>(mask.height), 0);
  for (Vector2& p : pen.points) p += mask.origin;
  draw_inside(pen, mask.width, mask.height, mask.words, mask.bits);
  draw_outlines(pen, radius, mask.width, mask.height, mask.words, mask.bits);
  find_runs(mask);
  find_ring(mask, pen.ring);
  return mask;
}

}  // namespace flipfree::unwrap
