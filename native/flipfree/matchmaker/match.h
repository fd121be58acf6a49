// Hard constraints (thesis 3.3): pinned vertices, lines and whole boundaries met bit for bit,
// without a fold.
//
// The ways to such a map stand in match.cpp, in the order in which they are tried; the last,
// MatchMaker++, always succeeds (up to 64-bit resolution) and refines most.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/matchmaker/request.h"

namespace flipfree::matchmaker {

// surface: a disk, or a connected piece of genus 0 with more than one boundary loop. Guarantee: the
// certificate of the result holds: no flips in 64 and 32 bits (G1), corners wind once (G2),
// constraints are met bit for bit in 64 bits and, rounded, in 32 (G3), the mesh subdivides the
// input (G7). Throws InvalidInput, Infeasible (see request.h, outline_target.h), NotConverged
// (kTimeLimit: no map was found in max_seconds), Cancelled. Stats: "engine" (what made the map:
// "first try", "continuation", "planned", "arms", "coarse to fine", "homotopy", "unwrapped",
// "matchmaker"), "added_vertices", "energy", "seconds_*", // "distortion.*", "rounding.*",
// "time_limit_reached" (1: the map might have become better, or have fewer vertices, with more
// time). Deterministic for any number of threads as long as no limit of time is reached.
//
// Of several boundary loops a prescribed boundary is that of the one which request.boundary_loop
// names (it must); with a free boundary the longest counts as the outer one. The others are holes
// (stats "holes"), a monkey's eyes or a T-shirt's sleeves: free, but for the pins and lines on
// them.
//
//   fill every hole with a fan -> match the disk -> take the fans away -> lower the distortion
//
// A flip-free map of the filled disk is one of the piece; the fans' own shape is of no interest and
// may be refined at no cost. What they did to the distortion is undone by improve(), which lets
// holes deform as they like.
certify::Parametrization match(const mesh::Surface& surface, const MatchRequest& request,
                               const MatchOptions& options, ExecutionContext& context);

}  // namespace flipfree::matchmaker
