#include "flipfree/seamless/padding/straight/linear_scale.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/numeric/cholesky/laplacian_factor.h"
#include "flipfree/seamless/padding/open_cut.h"

namespace flipfree::seamless {
namespace {

constexpr double kLeastWeight = 0.01;
constexpr double kMostWeight = 100.0;

// At corner c of its face: the vectors along its two sides.
struct Corner {
  double dot, cross;
};
Corner corner_of(const mesh::Surface& surface, HalfedgeId c) {
  const auto place = [&](HalfedgeId h) -> Vector3 {
    return surface.vertices.row(surface.faces(h / 3, h % 3));
  };
  const Vector3 a = place(next_corner(c)) - place(c), b = place(previous_corner(c)) - place(c);
  return {a.dot(b), a.cross(b).norm()};
}

double range_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return *high - *low;
}

}  // namespace

std::vector<double> edge_weights(const mesh::Surface& surface) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  std::vector<double> half(adjacency.opposite.size());
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const Corner apex = corner_of(surface, previous_corner(h));
    half[at(h)] = 0.5 * apex.dot / std::max(apex.cross, 1e-300);
  }
  std::vector<double> weight(half.size());
  for (std::size_t h = 0; h < half.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[h];
    const double sum = half[h] + (o == kInvalid ? 0.0 : half[at(o)]);
    weight[h] = std::clamp(std::isfinite(sum) ? sum : 0.0, kLeastWeight, kMostWeight);
  }
  return weight;
}

std::vector<double> linear_scale(const mesh::Surface& surface, const std::vector<double>& weight,
                                 const std::vector<double>& wish, ExecutionContext& context) {
  std::vector<double> u = wish;
  std::vector<numeric::Coupling> couplings;
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const VertexId v = mesh::source(surface.faces, h), w = mesh::target(surface.faces, h);
    const Corner corner = corner_of(surface, h);
    u[at(v)] -= std::atan2(corner.cross, corner.dot);
    couplings.push_back({std::min(v, w), std::max(v, w), weight[at(h)]});
  }
  std::sort(couplings.begin(), couplings.end(), [](const auto& a, const auto& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  // Both half-edges of an edge have its weight.
  couplings.erase(
      std::unique(couplings.begin(), couplings.end(),
                  [](const auto& a, const auto& b) { return a.low == b.low && a.high == b.high; }),
      couplings.end());
  numeric::LaplacianFactor factor;
  if (!factor.factorize(static_cast<Index>(u.size()), couplings, context)) {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The cut of the engine \"padding\" found no flat angles of the surface. "
                        "Remove degenerate faces, or take the engine \"penner\".");
  }
  factor.solve(u, context);
  return u;
}

double scale_range(const AdmissibleCut& cut, const std::vector<Index>& cones,
                   ExecutionContext& context) {
  if (cut.branches.empty()) return 0.0;
  const auto count = static_cast<Index>(cut.surface.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(count, cut.surface.faces);
  std::vector<Index> all = cones;
  all.resize(at(count), 4);
  const OpenCut open = open_cut(cut, adjacency, cut_segments(cut, adjacency), all);
  const mesh::InOwnUnit scaled(cut.surface);
  double range = 0.0;
  for (const mesh::Chart& chart : mesh::split_into_charts(scaled.surface().vertices, open.mesh)) {
    std::vector<double> wish;
    for (const VertexId v : chart.vertices) wish.push_back(open.angle[at(v)]);
    range = std::max(
        range, range_of(linear_scale(chart.surface, edge_weights(chart.surface), wish, context)));
  }
  return range;
}

}  // namespace flipfree::seamless
