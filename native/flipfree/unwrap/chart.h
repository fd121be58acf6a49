// One chart onto the plane: embedding, then least distortion, optionally meeting pins.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/surface.h"

namespace flipfree {

struct FlattenOptions {
  bool bijective = true;  // the chart may not overlap itself
  int max_iterations = 200;
  double tolerance = 1e-4;
  std::vector<std::pair<VertexId, Vector2>> pins;  // chart vertices and their UVs, met bit for bit
};

// #V x 2, flip-free in 64 bits. Precondition: a connected, validated surface of genus 0 with a
// boundary. Without pins the scale is the surface's own and the bounding box is centred at the
// origin; with pins the place is theirs. Throws NotConverged (kLineSearchStalled) naming the first
// pin that flip-free deformation on this triangulation did not reach, Cancelled.
Points2 flatten_chart(const Surface& chart, const FlattenOptions& options,
                      ExecutionContext& context, Stats& stats);

}  // namespace flipfree
