// One chart onto the plane: embedding, then least distortion, optionally meeting pins.
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

struct FlattenOptions {
  bool bijective = true;  // the chart may not overlap itself
  // Where the chart cannot be laid out without overlap at a distortion near that of its free map,
  // it may be cut. Never with pins.
  bool may_add_cuts = false;
  // Share of a piece's area by which it may still overlap itself after a cut, to be held apart
  // next.
  double tolerated_overlap = 0.1;
  // With may_add_cuts: a chart is held apart at this energy at most, and cut otherwise.
  double most_energy = std::numeric_limits<double>::infinity();
  int held_steps = 100;        // of holding apart, before a cut is the better way
  mesh::EdgeFlags uncuttable;  // of the chart's half-edges, may be empty; see separating_cut()
  int max_iterations = 200;
  double tolerance = 1e-4;
  bool acceptable = true;                          // ExecutionContext::accept() ends the descent
  std::vector<std::pair<VertexId, Vector2>> pins;  // chart vertices and their UVs, met bit for bit
};

// A finished chart, or one that is to be cut into pieces for flatten_piece().
struct FlatChart {
  Points2 uv;           // #V x 2, flip-free in 64 bits; of least distortion where there is a cut
  mesh::EdgeFlags cut;  // empty, or the edges of the chart along which it is to be cut
};

// Precondition: a connected, validated surface of genus 0 with a boundary. Without pins the scale
// is the surface's own and the bounding box is centred at the origin; with pins the place is
// theirs. Throws NotConverged (kLineSearchStalled) naming the first pin that flip-free deformation
// on this triangulation did not reach, Cancelled.
FlatChart flatten_chart(const mesh::Surface& chart, const FlattenOptions& options,
                        ExecutionContext& context, Stats& stats);

// A piece of a chart that was cut as flatten_chart() said, from its part of that chart's map
// (#V x 2); anew where that overlaps itself still.
FlatChart flatten_piece(const mesh::Surface& piece, Points2 uv, const FlattenOptions& options,
                        ExecutionContext& context, Stats& stats);

}  // namespace flipfree::unwrap
