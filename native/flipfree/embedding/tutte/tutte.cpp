#include "flipfree/embedding/tutte/tutte.h"

#include <algorithm>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/embedding/disk/disk.h"
#include "flipfree/embedding/tutte/convex_combination.h"
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
  const InnerStars stars = inner_stars(faces, numbering);
  const Size n = numbering.inner.size();
  ConvexCombinations system;
  system.start.assign(n + 1, 0);
  system.column.reserve(stars.halfedge.size());
  system.weight.reserve(stars.halfedge.size());
  system.fixed_weight.assign(n, 0.0);
  system.fixed_sum = Points2::Zero(static_cast<Index>(n), 2);
  for (Size i = 0; i < n; ++i) {
    for (Index k = stars.start[i]; k < stars.start[i + 1]; ++k) {
      const HalfedgeId h = stars.halfedge[static_cast<Size>(k)];
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
  const InnerStars stars = inner_stars(faces, numbering);
  context.check();
  const Index n = static_cast<Index>(numbering.inner.size());
  if (n == 0) return gather(numbering, loop, boundary, Points2(0, 2));

  // Graph Laplacian with the boundary moved to the right-hand side; lower triangle, column by
  // column.
  numeric::SparseMatrix matrix(n, n);
  matrix.resizeNonZeros(n + (stars.start.back() + 1) / 2);
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(n, 2);
  std::vector<Index> later;
  Index used = 0;
  for (Index i = 0; i < n; ++i) {
    later.clear();
    const Index begin = stars.start[static_cast<Size>(i)];
    const Index end = stars.start[static_cast<Size>(i) + 1];
    for (Index k = begin; k < end; ++k) {
      const Size v =
          static_cast<Size>(faces.data()[next_corner(stars.halfedge[static_cast<Size>(k)])]);
      const Index j = numbering.inner_index[v];
      if (j == kInvalid) {
        rhs.row(i) += boundary.row(numbering.boundary_index[v]);
      } else if (j > i) {
        later.push_back(j);
      }
    }
    std::sort(later.begin(), later.end());
    matrix.outerIndexPtr()[i] = used;
    matrix.innerIndexPtr()[used] = i;
    matrix.valuePtr()[used++] = static_cast<double>(end - begin);
    for (const Index j : later) {
      matrix.innerIndexPtr()[used] = j;
      matrix.valuePtr()[used++] = -1.0;
    }
  }
  matrix.outerIndexPtr()[n] = used;
  matrix.resizeNonZeros(used);

  context.report("Tutte embedding", 0.1);
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  context.report("Tutte embedding", 0.5);
  if (!cholesky.factorize(matrix, context)) {
    throw_not_converged(
        ErrorCode::kFactorizationFailed,
        "Tutte's matrix is not positive definite: a vertex has no path to the boundary.");
  }
  return gather(numbering, loop, boundary, cholesky.solve(rhs, context));
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
  // Face on the other side of the edge a -> b of half-edge h is the one whose previous corner edge
  // ends at a from b: found among the star of a as the half-edge whose face has b as the last
  // corner.
  context.check();
  std::vector<double> other(static_cast<Size>(faces.size()), 0.0);
  const InnerStars stars = inner_stars(faces, numbering);
  std::vector<HalfedgeId> ending(static_cast<Size>(shape.rows()), kInvalid);
  for (Size i = 0; i + 1 < stars.start.size(); ++i) {
    for (Index k = stars.start[i]; k < stars.start[i + 1]; ++k) {
      const HalfedgeId h = stars.halfedge[static_cast<Size>(k)];
      ending[static_cast<Size>(faces.data()[previous_corner(h)])] = h;
    }
    for (Index k = stars.start[i]; k < stars.start[i + 1]; ++k) {
      const HalfedgeId h = stars.halfedge[static_cast<Size>(k)];
      const HalfedgeId g = ending[static_cast<Size>(faces.data()[next_corner(h)])];
      other[static_cast<Size>(h)] = tangent[static_cast<Size>(g)];
    }
  }
  const ConvexCombinations system = build_system(faces, numbering, boundary, [&](HalfedgeId h) {
    const double distance = length(faces.data()[h], faces.data()[next_corner(h)]);
    const double w =
        (tangent[static_cast<Size>(h)] + other[static_cast<Size>(h)]) / std::max(distance, 1e-50);
    return std::clamp(w, 1e-100, 1e100);
  });
  return gather(numbering, loop, boundary, solve_convex_combinations(system, context));
}

}  // namespace flipfree::embedding
