// The holes that cutting along disjoint loops makes, two per loop, and a way to string them up
// (thesis 5.3.1, 5.4.1).
//
// Hole 2 l is on the left of loop l, hole 2 l + 1 on its right: partners.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/canvas.h"
#include "flipfree/seamless/padding/straight/hole_tour.h"

namespace flipfree::seamless {

class Holes {
 public:
  // `loops`: vertices in order, drawn. Their edges must not be split while this is used.
  Holes(const Canvas& canvas, std::vector<std::vector<VertexId>> loops);

  Index count() const { return 2 * static_cast<Index>(loops_.size()); }
  // Sectors of a vertex of the loop on the hole's side, counter-clockwise: one, and one more per
  // connector that ends there.
  std::vector<HalfedgeId> sectors_at(Index hole, VertexId v) const;
  // Those of all vertices of the loop that no connector has reached from either side.
  std::vector<HalfedgeId> open_sectors(Index hole) const;
  // Is this sector, of a vertex of the loop, on the hole's side?
  bool has(Index hole, HalfedgeId sector) const;
  // The hole on whose side this sector of a loop's vertex is.
  Index hole_of(HalfedgeId sector) const;
  bool is_open(VertexId v) const { return canvas_.drawn_around(v).size() == 2; }
  Index loop_of(VertexId v) const;

 private:
  VertexId neighbour(VertexId v, Index step) const;

  const Canvas& canvas_;
  std::vector<std::vector<VertexId>> loops_;
  std::vector<std::array<Index, 2>> where_;  // per vertex when this was made: loop, number in it
};

// A distance from hole to hole.
struct HolePair {
  Index a, b;
  double distance;
};
// Of holes that are neighbours: a path from one to the other meets no third one's surroundings.
// Cost: O(#F log #F).
std::vector<HolePair> hole_neighbours(const Canvas& canvas, const Holes& holes,
                                      const ExecutionContext& context);

// All holes in an order in which one is near the one before; the first and the last are partners.
// odd_couple: with two partners between which there is an odd number of holes, which takes three
// loops or more. Cost: O(count^2 log count).
std::vector<Index> hole_order(Index count, const std::vector<HolePair>& neighbours,
                              bool odd_couple);

}  // namespace flipfree::seamless
