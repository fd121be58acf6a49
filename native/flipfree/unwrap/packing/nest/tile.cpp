#include "flipfree/unwrap/packing/nest/tile.h"

#include <algorithm>
#include <array>
#include <bit>

namespace flipfree::unwrap {
namespace {

constexpr int kMostWords = 128;  // tiles of at most 8192 cells

// Powers of two up to `cells`. What the library's function returns differs between its versions.
int levels_of(int cells) { return static_cast<int>(std::bit_width(static_cast<unsigned>(cells))); }

// The first `count` words of into |= from shifted to lower cells by `by`; `from` has `words` words
// and an empty one more.
void or_shifted(const Word* from, int by, int words, Word* into, int count) {
  const int skip = by / 64;
  const int bits = by % 64;
  count = std::min(count, words - skip);
  if (bits == 0) {
    for (int w = 0; w < count; ++w) into[w] |= from[w + skip];
    return;
  }
  for (int w = 0; w < count; ++w)
    into[w] |= (from[w + skip] >> bits) | (from[w + skip + 1] << (64 - bits));
}

}  // namespace

Tile::Tile(int cells) : cells_(cells), words_((cells + 63) / 64), count_(levels_of(cells)) {
  levels_.assign(static_cast<std::size_t>(count_) * static_cast<std::size_t>(cells_) *
                     static_cast<std::size_t>(words_ + 1),
                 0);
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
    const int skip = step / 64;
    const int bits = step % 64;
    // A level's cell looks as far to the right as its runs are long.
    const int begin = std::max(0, first - (2 * step + 63) / 64);
    const int inside = std::min(last + 1, words_ - skip);
    if (bits == 0) {
      for (int w = begin; w < inside; ++w) into[w] = from[w] | from[w + skip];
    } else {
      for (int w = begin; w < inside; ++w)
        into[w] = from[w] | (from[w + skip] >> bits) | (from[w + skip + 1] << (64 - bits));
    }
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
    if (last_x % 64 != 63)
      blocked[static_cast<std::size_t>(words - 1)] = ~Word{0} << (last_x % 64 + 1);
    // Rows in an order that soon meets what is in the way: from the middle on, far steps first.
    bool all = false;
    constexpr int kStride = 5;
    const int half = mask.height / 2;
    for (int phase = 0; phase < kStride && !all; ++phase) {
      for (int i = phase; i < mask.height && !all; i += kStride) {
        const int j = i + half < mask.height ? i + half : i + half - mask.height;
        for (int r = mask.row_begin[static_cast<std::size_t>(j)];
             r < mask.row_begin[static_cast<std::size_t>(j) + 1]; ++r) {
          const Run& run = mask.runs[static_cast<std::size_t>(r)];
          const int k = levels_of(run.last - run.first + 1) - 1;
          const Word* row = level(k, y + j);
          or_shifted(row, run.first, words_, blocked.data(), words);
          const int second = run.last + 1 - (1 << k);
          if (second != run.first) or_shifted(row, second, words_, blocked.data(), words);
        }
        ++rows;
        Word free = 0;
        for (int w = 0; w < words; ++w) free |= ~blocked[static_cast<std::size_t>(w)];
        all = free == 0;
      }
    }
    if (all) continue;
    for (int w = 0; w < words; ++w) {
      const Word free = ~blocked[static_cast<std::size_t>(w)];
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
    for (int r = mask.row_begin[static_cast<std::size_t>(j)];
         r < mask.row_begin[static_cast<std::size_t>(j) + 1]; ++r) {
      const Run& run = mask.runs[static_cast<std::size_t>(r)];
      const int k = levels_of(run.last - run.first + 1) - 1;
      const Word* row = level(k, cell.y + j);
      const int first = cell.x + run.first;
      const int second = cell.x + run.last + 1 - (1 << k);
      if (((row[first / 64] >> (first % 64)) & 1) != 0 ||
          ((row[second / 64] >> (second % 64)) & 1) != 0)
        return false;
    }
  }
  return true;
}

Word Tile::word_at(int x, int y) const {
  const Word* row = level(0, y);
  const auto whole = [&](int w) {
    if (w < 0 || w >= words_) return ~Word{0};
    if (w < words_ - 1 || cells_ % 64 == 0) return row[w];
    return row[w] | ~Word{0} << (cells_ % 64);
  };
  const int w = x >= 0 ? x / 64 : -1;
  const int bits = x - 64 * w;
  return bits == 0 ? whole(w) : (whole(w) >> bits) | (whole(w + 1) << (64 - bits));
}

double Tile::contact(const Mask& mask, const Cell& cell) const {
  int touched = 0;
  for (int j = 0; j < mask.height + 2; ++j) {
    const int y = cell.y + j - 1;
    const Word* ring = &mask.ring[static_cast<std::size_t>(j * mask.ring_words)];
    for (int w = 0; w < mask.ring_words; ++w) {
      const Word taken = y < 0 || y >= cells_ ? ~Word{0} : word_at(cell.x - 1 + 64 * w, y);
      touched += std::popcount(ring[w] & taken);
    }
  }
  return static_cast<double>(touched) / std::max(1, mask.ring_cells);
}

template <typename Change>
void Tile::change(const Mask& mask, const Cell& cell, Change change) {
  const int skip = cell.x / 64;
  const int bits = cell.x % 64;
  for (int j = 0; j < mask.height; ++j) {
    Word* row = level(0, cell.y + j);
    const Word* own = &mask.bits[static_cast<std::size_t>(j * mask.words)];
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
