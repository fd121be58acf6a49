// Flat surfaces whose triangulations are far from Delaunay, with their overlays, ready to be
// developed.
#pragma once

#include <random>
#include <vector>

#include "flipfree/intrinsic/layout/layout.h"
#include "support/flipped_metrics.h"
#include "support/shapes.h"

namespace flipfree::test {

inline mesh::Surface sheared_grid(unsigned seed = 2) {
  mesh::Surface surface = grid(6, 5);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.02, 0.02);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double x = surface.vertices(v, 0), y = surface.vertices(v, 1);
    surface.vertices.row(v) << x + 1.3 * y + uniform(random), y + uniform(random), 0.0;
  }
  return surface;
}

// A surface, its own metric made Delaunay, and the overlay of both. Not to be moved: the parts
// point at each other.
struct Traced {
  explicit Traced(const mesh::Surface& of)
      : surface(of),
        adjacency(mesh::build_adjacency(static_cast<Index>(of.vertices.rows()), of.faces)),
        metric(scaled_metric(
            of, std::vector<double>(static_cast<std::size_t>(of.vertices.rows()), 0.0))),
        overlaid(intrinsic::overlay_metric(metric, nullptr, adjacency, intrinsic::kMaxCrossings,
                                           ExecutionContext())),
        curve_of_edge(metric.initial.edge_count(), kInvalid),
        cut(metric.initial.edge_count(), 0) {
    cut_along(mesh::EdgeFlags(static_cast<std::size_t>(3 * of.faces.rows()), 0));
  }
  Traced(const Traced&) = delete;
  Traced& operator=(const Traced&) = delete;

  void cut_along(const mesh::EdgeFlags& cuts) {
    for (std::size_t e = 0; e < overlaid.edges.halfedge.size(); ++e) {
      const auto h = static_cast<std::size_t>(overlaid.edges.halfedge[e]);
      const auto own =
          static_cast<std::size_t>(intrinsic::FlipMesh::edge(metric.input_halfedge[h]));
      curve_of_edge[own] = static_cast<Index>(e);
      cut[own] = adjacency.opposite[h] == kInvalid || cuts[h];
    }
  }
  intrinsic::TracedMesh input() const {
    const intrinsic::Overlay& o = overlaid.overlay;
    return {&o.coordinates, &o.trace, &o.positions, &metric.input_halfedge, &curve_of_edge, &cut};
  }
  std::vector<double> lengths() const { return intrinsic::to_doubles(metric.length); }
  intrinsic::Development developed() const {
    return intrinsic::develop(input(), lengths(), ExecutionContext());
  }

  mesh::Surface surface;
  mesh::Adjacency adjacency;
  intrinsic::FlippedMetric metric;
  intrinsic::MetricOverlay overlaid;
  std::vector<Index> curve_of_edge;
  std::vector<char> cut;
};

inline Vector2 to_plane(const intrinsic::Place& p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

}  // namespace flipfree::test
