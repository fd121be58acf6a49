#include "flipfree/unwrap/packing/nest/mask.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace flipfree::unwrap {
namespace {

struct Span {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

// Against rounding of what touches a cell's edge, in cells.
constexpr double kCare = 1e-9;

// The x of the disc's points with y in [bottom, bottom + 1].
void add_disc(const Vector2& p, double radius, double bottom, Span& span) {
  const double off = std::max({0.0, bottom - p.y(), p.y() - bottom - 1.0});
  if (off > radius) return;
  const double half = std::sqrt(radius * radius - off * off);
  span.add(p.x() - half);
  span.add(p.x() + half);
}

void add_side(const Vector2& a, const Vector2& b, double bottom, Span& span) {
  const double low = std::min(a.y(), b.y());
  const double high = std::max(a.y(), b.y());
  if (low > bottom + 1.0 || high < bottom) return;
  const auto at = [&](double y) {
    const double t = std::clamp((y - a.y()) / (b.y() - a.y()), 0.0, 1.0);
    return a.x() + t * (b.x() - a.x());
  };
  if (high - low < 1e-12) {
    span.add(a.x());
    span.add(b.x());
    return;
  }
  span.add(at(std::max(bottom, low)));
  span.add(at(std::min(bottom + 1.0, high)));
}

// The inside of the loops at the rows' middles; cells that only touch it are the outline's.
void draw_inside(const std::vector<Loop>& loops, int width, int height, int words,
                 std::vector<Word>& bits) {
  double bottom = height;
  double top = 0.0;
  for (const Loop& loop : loops) {
    for (const Vector2& p : loop) {
      bottom = std::min(bottom, p.y());
      top = std::max(top, p.y());
    }
  }
  // Rows from here to there; a triangle among thousands has few.
  const int begin = static_cast<int>(std::clamp(std::floor(bottom), 0.0, height + 0.0));
  const int end = static_cast<int>(std::clamp(std::ceil(top) + 1.0, 0.0, height + 0.0));
  if (begin >= end) return;
  std::vector<std::vector<std::pair<double, int>>> crossings(static_cast<std::size_t>(end - begin));
  for (const Loop& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      Vector2 a = loop[i];
      Vector2 b = loop[(i + 1) % loop.size()];
      const int way = a.y() < b.y() ? 1 : -1;
      if (way < 0) std::swap(a, b);
      const int first =
          static_cast<int>(std::clamp(std::ceil(a.y() - 0.5), begin + 0.0, end + 0.0));
      const int last =
          static_cast<int>(std::clamp(std::ceil(b.y() - 0.5) - 1.0, begin - 1.0, end - 1.0));
      for (int row = first; row <= last; ++row) {
        const double t = (row + 0.5 - a.y()) / (b.y() - a.y());
        crossings[static_cast<std::size_t>(row - begin)].emplace_back(a.x() + t * (b.x() - a.x()),
                                                                      way);
      }
    }
  }
  for (int row = begin; row < end; ++row) {
    auto& own = crossings[static_cast<std::size_t>(row - begin)];
    std::sort(own.begin(), own.end());
    int winding = 0;
    for (std::size_t i = 0; i + 1 < own.size(); ++i) {
      winding += own[i].second;
      if (winding != 0)
        set_cells(&bits[static_cast<std::size_t>(row * words)], width, own[i].first,
                  own[i + 1].first);
    }
  }
}

void find_runs(Mask& mask) {
  mask.row_begin.assign(1, 0);
  mask.runs.clear();
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

void find_ring(Mask& mask) {
  mask.ring_words = (mask.width + 2 + 63) / 64;
  const auto words = static_cast<std::size_t>(mask.ring_words);
  const auto rows = static_cast<std::size_t>(mask.height) + 2;
  // The mask itself, one cell further right and up.
  std::vector<Word> own(words * rows, 0);
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
  const double reach = radius + kCare;
  const auto row_of = [&](double y) {
    return static_cast<int>(std::clamp(std::floor(y), -1.0, static_cast<double>(height)));
  };
  const int first = std::max(0, row_of(std::min(a.y(), b.y()) - reach));
  const int last = std::min(height - 1, row_of(std::max(a.y(), b.y()) + reach));
  const Vector2 side = b - a;
  const double length = side.norm();
  const Vector2 off =
      length > 0.0 ? Vector2(-side.y(), side.x()) * (reach / length) : Vector2(0.0, 0.0);
  const std::array<Vector2, 4> quad = {a + off, b + off, b - off, a - off};
  for (int row = first; row <= last; ++row) {
    Span span;
    add_disc(a, reach, row, span);
    add_disc(b, reach, row, span);
    if (length > 0.0) {
      for (std::size_t k = 0; k < 4; ++k) add_side(quad[k], quad[(k + 1) % 4], row, span);
    }
    if (span.low <= span.high)
      set_cells(&bits[static_cast<std::size_t>(row * words)], width, span.low, span.high);
  }
}

void draw_loop(const Loop& loop, int cells, double radius, int words, std::vector<Word>& bits) {
  std::vector<Loop> loops = {loop};
  for (Vector2& p : loops.front()) p *= cells;
  draw_inside(loops, cells, cells, words, bits);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    draw_segment(loops.front()[i], loops.front()[(i + 1) % loop.size()], radius, cells, cells,
                 words, bits);
  }
}

Mask draw_shape(const Shape& shape, const Vector2& turn, double scale, double radius) {
  std::vector<Loop> loops;
  Vector2 low = Vector2::Constant(std::numeric_limits<double>::infinity());
  Vector2 high = -low;
  const Pose pose{Vector2::Zero(), turn};
  for (const Loop& loop : shape.loops) {
    Loop& drawn = loops.emplace_back();
    for (const Vector2& p : loop) {
      drawn.push_back(pose(p, scale));
      low = low.cwiseMin(drawn.back());
      high = high.cwiseMax(drawn.back());
    }
  }
  Mask mask;
  const Vector2 care = Vector2::Constant(radius + 2.0 * kCare);
  mask.origin = care - low;
  const Vector2 size = high - low + 2.0 * care;
  mask.width = std::max(1, static_cast<int>(std::ceil(size.x())));
  mask.height = std::max(1, static_cast<int>(std::ceil(size.y())));
  mask.words = (mask.width + 63) / 64;
  mask.bits.assign(static_cast<std::size_t>(mask.words) * static_cast<std::size_t>(mask.height), 0);
  for (Loop& loop : loops)
    for (Vector2& p : loop) p += mask.origin;
  draw_inside(loops, mask.width, mask.height, mask.words, mask.bits);
  for (const Loop& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      draw_segment(loop[i], loop[(i + 1) % loop.size()], radius, mask.width, mask.height,
                   mask.words, mask.bits);
    }
  }
  find_runs(mask);
  find_ring(mask);
  return mask;
}

}  // namespace flipfree::unwrap
