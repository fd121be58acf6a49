// The path that makes two components of one disk, so that the cut can be equalized (thesis 5.3.2,
// 5.3.3).
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

// Which cut the cones ask for.
enum class Pattern {
  kNone,       // genus 0
  kChain,      // all cones are multiples of four
  kTwoTNodes,  // genus 1 and 2
  kExtraPath,  // genus 3 and more
  kLoop        // around a cone with k = 1
};
// Throws Infeasible (kBadAngles) if there is no surface with such cones: 3 and 5 on a torus.
// Precondition: check_cones() passed.
Pattern pattern_for(const std::vector<Index>& cones, Index genus);

// Are all cones even, and such that a twisted chain along which some loop turns by an odd number of
// quarters can be joined: with half of all corners, but for one more or less of two, on a side?
bool can_be_twisted(const std::vector<Index>& cones, Index genus);

// One sector of each T-node, each named by its first half-edge.
using JoinedSectors = std::array<HalfedgeId, 2>;
// All between which a path can leave parts that fit the cones. Preconditions:
// draw_chain_with_t_nodes() or draw_twisted_chain(), then divide_branches(); pattern_for() is
// kTwoTNodes, or can_be_twisted().
std::vector<JoinedSectors> joinable_sectors(const Canvas& canvas,
                                            const std::array<VertexId, 2>& t_nodes,
                                            const std::vector<Index>& cones);
// From one T-node to the other one, within the disk, between some of these sectors: the shortest
// path, false if the search finds none, or one around chosen cones, which there always is.
bool draw_shortest_joining_path(Canvas& canvas, const std::vector<JoinedSectors>& sectors,
                                const ExecutionContext& context);
void draw_fenced_joining_path(Canvas& canvas, const std::vector<JoinedSectors>& sectors,
                              const std::vector<Index>& cones, const ExecutionContext& context);

// From a hole to anywhere on the boundary, but if it is to the facing side of the same branch to
// the same vertex: with two T-nodes, or one node. The shortest one, or one around a single cone,
// likewise. Preconditions: draw_hole_chain(), then divide_branches(); pattern_for() is kExtraPath.
bool draw_shortest_extra_path(Canvas& canvas, const ExecutionContext& context);
void draw_fenced_extra_path(Canvas& canvas, const std::vector<Index>& cones, Index genus,
                            const ExecutionContext& context);

// Sectors beside the holes where a loop can begin and end. Preconditions: as above.
std::vector<HalfedgeId> sectors_on_holes(const Canvas& canvas);
// From one of these sectors around the nearest cone with k = 1 and back. pattern_for() is kLoop.
void draw_loop_around_cone(Canvas& canvas, const std::vector<HalfedgeId>& sectors,
                           const std::vector<Index>& cones, const ExecutionContext& context);

// Cones whose excess sums to a given number (thesis 5.3.3).

// Vertices with cones (k other than 4) whose k - 4 sum to `excess`, by dynamic programming; nothing
// if there are none. `cones`: #V, quarter turns. excess: not zero. Cost: O(number of cones * range
// of their sums).
std::optional<std::vector<VertexId>> cones_with_excess(const std::vector<Index>& cones,
                                                       Index excess);

}  // namespace flipfree::seamless
