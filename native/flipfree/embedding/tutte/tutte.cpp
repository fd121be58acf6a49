#include "flipfree/embedding/tutte/tutte.h"

#include <algorithm>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/embedding/disk/disk.h"
#include "flipfree/embedding/tutte/convex_combination.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// Tangent of half the angle at corner a of the triangle a, b, c, by lengths only: stays accurate
// for slivers (Floater 2003; tan(A/2) = r / (s - opposite) with r the inradius).
double half_tangent(double opposite, double left, double right) {
  const double s_opposite = std::max(0.0, (left + right - opposite) / 2);
  const double s_left = std::max(0.0, (opposite + right - left) / 2);
  const double s_right = std::max(0.0, (opposite + left - right) / 2);
  const double s = (opposite + left + right) / 2;
  constexpr double kLargest = 1e50;  // products of normalised weights stay far from underflow
  if (!(s * s_opposite > 0.0)) return kLargest;
  return std::min(kLargest, std::sqrt(s_left * s_right / (s * s_opposite)));
}

// Rows for weights `weight_of(h)` on half-edges out of inner vertices.
template <typename WeightOf>
ConvexCombinations build_system(const Triangles& faces, const DiskNumbering& numbering,
                                const Points2& boundary, const WeightOf& weight_of) {
  const Lists<HalfedgeId> stars = inner_stars(faces, numbering);
  const Size n = numbering.inner.size();
  ConvexCombinations system;
  system.start.assign(n + 1, 0);
  system.fixed_weight.assign(n, 0.0);
  system.fixed_sum = Points2::Zero(static_cast<Index>(n), 2);
  for (Size i = 0; i < n; ++i) {
    for (const HalfedgeId h : stars[static_cast<Index>(i)]) {
      const Size v = static_cast<Size>(faces.data()[next_corner(h)]);
      const double w = weight_of(h);
      if (numbering.inner_index[v] != kInvalid) {
        system.column.push_back(numbering.inner_index[v]);
        system.weight.push_back(w);
      } else {
        system.fixed_weight[i] += w;
        system.fixed_sum.row(static_cast<Index>(i)) +=
            w * boundary.row(numbering.boundary_index[v]);
      }
    }
    system.start[i + 1] = static_cast<Index>(system.column.size());
  }
  return system;
}

Points2 gather(const DiskNumbering& numbering, const std::vector<VertexId>& loop,
               const Points2& boundary, const Points2& inner) {
  Points2 uv = Points2::Zero(static_cast<Index>(numbering.inner_index.size()), 2);
  for (Size i = 0; i < loop.size(); ++i) uv.row(loop[i]) = boundary.row(static_cast<Index>(i));
  for (Size i = 0; i < numbering.inner.size(); ++i)
    uv.row(numbering.inner[i]) = inner.row(static_cast<Index>(i));
  return uv;
}

}  // namespace

Points2 tutte_uniform(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop,
                      const Points2& boundary, ExecutionContext& context) {
  const DiskNumbering numbering = number_disk(faces, vertex_count, loop);
  const ConvexCombinations system =
      build_system(faces, numbering, boundary, [](HalfedgeId) { return 1.0; });
  context.check();
  const Index n = static_cast<Index>(numbering.inner.size());
  if (n == 0) return gather(numbering, loop, boundary, Points2(0, 2));

  // Graph Laplacian with the boundary moved to the right-hand side, lower triangle.
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (Index i = 0; i < n; ++i) {
    double degree = system.fixed_weight[at(i)];
    for (Index k = system.start[at(i)]; k < system.start[at(i) + 1]; ++k) {
      const Index j = system.column[at(k)];
      degree += 1.0;
      if (j > i) entries.emplace_back(j, i, -1.0);
    }
    entries.emplace_back(i, i, degree);
  }
  numeric::SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());

  context.report("Tutte embedding", 0.1);
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  context.report("Tutte embedding", 0.5);
  if (!cholesky.factorize(matrix, context)) {
    throw_not_converged(
        ErrorCode::kFactorizationFailed,
        "Tutte's matrix is not positive definite: a vertex has no path to the boundary.");
  }
  return gather(numbering, loop, boundary, cholesky.solve(system.fixed_sum, context));
}

Points2 tutte_mean_value(const Triangles& faces, const Eigen::MatrixXd& shape,
                         const std::vector<VertexId>& loop, const Points2& boundary,
                         ExecutionContext& context) {
  const DiskNumbering numbering = number_disk(faces, static_cast<Index>(shape.rows()), loop);
  // The weight of the edge i -> j gathers the half tangents of the two angles at i beside it; each
  // half-edge h in face f gives its own face's angle, and the previous corner's edge gets the same
  // angle from its other side.
  const auto length = [&](VertexId a, VertexId b) { return (shape.row(a) - shape.row(b)).norm(); };
  std::vector<double> tangent(static_cast<Size>(faces.size()));
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const VertexId a = faces.data()[h];
    const VertexId b = faces.data()[next_corner(h)];
    const VertexId c = faces.data()[previous_corner(h)];
    tangent[static_cast<Size>(h)] = half_tangent(length(b, c), length(a, b), length(a, c));
  }
  context.check();
  const mesh::Adjacency adjacency = mesh::build_adjacency(static_cast<Index>(shape.rows()), faces);
  const ConvexCombinations system = build_system(faces, numbering, boundary, [&](HalfedgeId h) {
    const double distance = length(faces.data()[h], faces.data()[next_corner(h)]);
    const HalfedgeId beside = next_corner(adjacency.opposite[at(h)]);  // out of the same vertex
    const double w = (tangent[at(h)] + tangent[at(beside)]) / std::max(distance, 1e-50);
    return std::clamp(w, 1e-100, 1e100);
  });
  return gather(numbering, loop, boundary, solve_convex_combinations(system, context));
}

}  // namespace flipfree::embedding
