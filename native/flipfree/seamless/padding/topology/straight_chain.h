// A hole chain that turns little in the flat angles of the surface, so that the metric of the disk
// that it leaves is not far from the disk's own.
//
// Straight segments between right angles turn by nothing. Loops that turn are exchanged
// (straight_loops.h); connectors pay for what they miss of the right angles to the loops' mean
// directions at both their ends (turning_path.h); and the order of the holes is a tour over what
// these would cost (hole_tour.h).
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/straight/flat_angles.h"
#include "flipfree/seamless/padding/straight/turning_path.h"
#include "flipfree/seamless/padding/topology/holes.h"

namespace flipfree::seamless {

// Which way is straight ahead from a hole: at right angles to its loop, as that would run if it
// turned evenly all along.
class HoleFrames {
 public:
  // `loops`: hole 2 l is on the left of loop l, hole 2 l + 1 on its right; `meter`'s canvas has
  // them drawn.
  HoleFrames(const TurnMeter& meter, const std::vector<std::vector<VertexId>>& loops);

  // How far to the left of that a half-edge heads which leaves the hole's loop on the hole's side.
  double deviation(Index hole, HalfedgeId departure) const;

 private:
  const TurnMeter& meter_;
  struct Place {
    VertexId next = kInvalid;  // along the loop, the hole on the left
    double offset = 0.0;       // of the edge to it, from straight ahead
  };
  std::vector<std::vector<std::pair<VertexId, Place>>> places_;  // per hole, by vertex
};

// What a connector from each hole to each other one would cost, before any is drawn. Those that are
// not found, because others are nearer, cost what a way over others does and more. Symmetric. Cost:
// one search per hole.
std::vector<std::vector<double>> connector_costs(const TurnMeter& meter, const Holes& holes,
                                                 const HoleFrames& frames,
                                                 const TurningPrice& price,
                                                 const ExecutionContext& context);

// What a chain is to be straight in, and what that is worth.
struct Straightness {
  // flat_crossings() of the canvas' surface, or others in which it is flat but for its cones.
  const std::vector<double>& crossings;
  // Of a quarter turn that a curve misses, in mean lengths of the loops.
  double quarter_price;
};

// As draw_hole_chain(), genus 2 and more; draw_chain_with_t_nodes(); draw_twisted_chain()
// (hole_chain.h).
void draw_straight_chain(Canvas& canvas, Index genus, const Straightness& straight,
                         const ExecutionContext& context);
std::array<VertexId, 2> draw_straight_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                         const Straightness& straight,
                                                         const ExecutionContext& context);
std::array<VertexId, 2> draw_straight_twisted_chain(Canvas& canvas,
                                                    const std::vector<VertexId>& first, Index genus,
                                                    const Straightness& straight,
                                                    const ExecutionContext& context);

}  // namespace flipfree::seamless
