// The cells of a tile that are taken, and where in it a mask fits.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/unwrap/packing/nest/mask.h"

namespace flipfree::unwrap {

struct Cell {
  int x = 0;
  int y = 0;
};

class Tile {
 public:
  explicit Tile(int cells);  // to a side
  // The same with these cells taken, rows of words() words.
  Tile(int cells, const std::vector<Word>& taken);

  // Words that lowest() has looked at: a measure of work that is the same everywhere.
  std::uint64_t looked() const { return looked_; }
  int cells() const { return cells_; }
  int words() const { return words_; }

  // The lowest place, of the lowest ones the leftmost, whose row is in [from, to]: the mask's lower
  // left corner. Cost: a few words per run of the mask and row of the tile.
  std::optional<Cell> lowest(const Mask& mask, int from, int to) const;
  bool fits(const Mask& mask, const Cell& cell) const;
  // The share of the cells around the mask there that are taken or outside.
  double contact(const Mask& mask, const Cell& cell) const;

  void put(const Mask& mask, const Cell& cell);
  void take(const Mask& mask, const Cell& cell);  // what was put there

 private:
  const Word* level(int k, int row) const {
    return &levels_[(static_cast<std::size_t>(k) * static_cast<std::size_t>(cells_) +
                     static_cast<std::size_t>(row)) *
                    static_cast<std::size_t>(words_ + 1)];
  }
  Word* level(int k, int row) { return const_cast<Word*>(std::as_const(*this).level(k, row)); }
  template <typename Change>
  void change(const Mask& mask, const Cell& cell, Change change);
  void widen(int row, int first, int last);  // where level 0 changed in these words
  Word word_at(int x, int y) const;          // 64 cells from x on; those outside are taken

  int cells_;
  int words_;
  int count_;  // levels
  // Level k, row, word (one more, empty): bit x says that one of the cells x .. x + 2^k - 1 is
  // taken.
  std::vector<Word> levels_;
  mutable std::uint64_t looked_ = 0;
};

}  // namespace flipfree::unwrap
