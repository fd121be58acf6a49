// Metrics made by flips, for tests of what is built on them.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/delaunay_metric.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// The surface's own metric made Delaunay, then scaled by exp((u_i + u_j) / 2) in stages and made
// Delaunay again. `u`: per vertex.
inline intrinsic::FlippedMetric scaled_metric(const mesh::Surface& surface,
                                              const std::vector<double>& u) {
  using intrinsic::FlipRule;
  constexpr int kStages = 16;
  const ExecutionContext context;
  intrinsic::IntrinsicSetup setup =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
  intrinsic::FlippedMetric metric;
  const std::vector<double> lengths =
      intrinsic::euclidean_lengths<double>(setup.mesh, surface.vertices, 53);
  intrinsic::DelaunayMetric<double> working(setup.mesh, lengths, 53);
  working.make_delaunay<FlipRule::kEuclidean>(context);
  metric.euclidean_flips = working.flips().size();
  for (int stage = 0; stage < kStages; ++stage) {
    const intrinsic::IntrinsicMesh& mesh = working.mesh();
    working.change_lengths([&](std::size_t e, double& length) {
      const auto end = [&](std::size_t h) {
        return u[static_cast<std::size_t>(mesh.unknown[static_cast<std::size_t>(mesh.origin[h])])];
      };
      length *= std::exp(0.5 * (end(2 * e) + end(2 * e + 1)) / kStages);
    });
    working.make_delaunay<FlipRule::kPtolemy>(context);
  }
  metric.initial = std::move(setup.mesh);
  metric.input_halfedge = std::move(setup.input_halfedge);
  metric.on_boundary = std::move(setup.on_boundary);
  metric.initial_length = lengths;
  metric.flips = working.flips();
  metric.mesh = working.mesh();
  metric.length = working.lengths();
  metric.u = u;
  return metric;
}

}  // namespace flipfree::test
