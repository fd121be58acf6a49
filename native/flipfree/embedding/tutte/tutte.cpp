#include "flipfree/embedding/tutte/tutte.h"

#include "flipfree/base/error.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::embedding {

Points2 tutte_uniform(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop,
                      const Points2& boundary, ExecutionContext& context) {
  // Every neighbour of an inner vertex is the target of one half-edge out of it.
  std::vector<Index> degree(static_cast<std::size_t>(vertex_count), 0);
  for (CornerId c = 0; c < faces.size(); ++c) ++degree[at(faces.data()[c])];
  Points2 uv = Points2::Zero(vertex_count, 2);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    uv.row(loop[i]) = boundary.row(static_cast<Index>(i));
    degree[at(loop[i])] = 0;  // no unknown
  }
  std::vector<Index> unknown(degree.size(), kInvalid);
  std::vector<VertexId> inner;
  for (VertexId v = 0; v < vertex_count; ++v) {
    if (degree[at(v)] == 0) continue;
    unknown[at(v)] = static_cast<Index>(inner.size());
    inner.push_back(v);
  }
  const Index n = static_cast<Index>(inner.size());
  if (n == 0) return uv;
  context.check();

  // Graph Laplacian with the boundary moved to the right-hand side, lower triangle.
  std::vector<Eigen::Triplet<double, Index>> entries;
  Points2 fixed_sum = Points2::Zero(n, 2);
  for (Index i = 0; i < n; ++i) entries.emplace_back(i, i, degree[at(inner[at(i)])]);
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const Index i = unknown[at(faces.data()[h])];
    const VertexId neighbour = faces.data()[next_corner(h)];
    const Index j = unknown[at(neighbour)];
    if (i == kInvalid) continue;
    if (j == kInvalid) fixed_sum.row(i) += uv.row(neighbour);
    if (j > i) entries.emplace_back(j, i, -1.0);
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
  const Points2 solution = cholesky.solve(fixed_sum, context);
  for (Index i = 0; i < n; ++i) uv.row(inner[at(i)]) = solution.row(i);
  return uv;
}

}  // namespace flipfree::embedding
