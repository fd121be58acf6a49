// Shapes one after the other into the cells of a tile.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/packing/nest/tile.h"

namespace flipfree::unwrap {

// The directions in which a shape may be put.
std::vector<Vector2> quarter_turns();
std::vector<Vector2> even_turns(int count);  // a multiple of 4

// All shapes in all their directions as cells, at one scale.
struct Masks {
  double scale = 0.0;
  int cells = 0;  // of the tile, to a side
  std::vector<std::vector<Mask>> of_shape;
};
// radius: half of the margin, in units of the tile. Cost: see draw_shape.
Masks draw_shapes(const std::vector<Shape>& shapes, const std::vector<std::vector<Vector2>>& turns,
                  double scale, int cells, double radius, const ExecutionContext& context);

// How the place of a shape is chosen among the lowest ones of all its directions.
struct Rule {
  double height = 1.0;   // weight of the mask's own height: 0 its foot, 1 its top is to be low
  double contact = 0.0;  // what touching all around is worth, in heights of the mask
};

struct Filling {
  std::vector<int> turn;  // per shape: the direction, -1 if it found no place
  std::vector<Cell> cell;
  double looked = 0.0;   // words of the tile
  double missing = 0.0;  // area of the shapes that found no place, as a share
  bool complete() const { return missing == 0.0; }
};

// Puts the shapes into the tile in this order, each where the rule likes it best; passes over those
// that fit nowhere, and ends once their share of the area is more than `most_missing`.
Filling fill(const std::vector<Shape>& shapes, const Masks& masks, Tile tile,
             const std::vector<std::size_t>& order, const Rule& rule, double most_missing,
             const ExecutionContext& context);

// The filling in masks of another scale: shapes stay in their cell or go to one beside it; those
// that cannot are missing.
Filling carry(const std::vector<Shape>& shapes, const Masks& masks, const Tile& empty,
              const Filling& filling);

// Tries to complete a filling: takes away what lies around a random place, puts back what is
// missing there first, and goes on from what it has unless more is missing than before. Ends after
// so many tries in a row after which no less is missing, or when it has looked at `work` words of
// the tile. Deterministic.
struct MendLimits {
  std::size_t tries = 0;
  double work = 0.0;
};
Filling mend(const std::vector<Shape>& shapes, const Masks& masks, const Tile& empty,
             Filling filling, std::uint64_t seed, const MendLimits& limits,
             const ExecutionContext& context);

// Where the shapes of a filling lie, in units of the tile.
std::vector<Pose> poses_of(const Filling& filling, const Masks& masks,
                           const std::vector<std::vector<Vector2>>& turns);

}  // namespace flipfree::unwrap
