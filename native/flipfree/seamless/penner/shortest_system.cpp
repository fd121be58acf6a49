#include "flipfree/seamless/penner/shortest_system.h"

#include <Eigen/SparseCore>

#include "flipfree/numeric/dense_factors.h"
#include "flipfree/seamless/bordered/symmetric_changes.h"

namespace flipfree::seamless {

using intrinsic::IntrinsicMesh;

namespace {

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;

// Jv', #E x #V.
SparseRows vertex_derivatives(const IntrinsicMesh& mesh, Eigen::Index vertex_count,
                              const std::vector<double>& cotangent) {
  const double share = face_share(mesh);
  const auto vertex = [&](std::size_t h) { return mesh.unknown[at(mesh.origin[h])]; };
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(4 * mesh.edge_count() + 2 * mesh.edge_count());
  for (std::size_t h = 0; h < cotangent.size(); ++h) {
    const HalfedgeId n = mesh.next[h], p = mesh.next[at(n)];
    const auto e = static_cast<Index>(h / 2);
    entries.emplace_back(e, vertex(at(p)), share * (cotangent[at(n)] + cotangent[at(p)]));
    entries.emplace_back(e, vertex(h), -share * cotangent[at(p)]);
    entries.emplace_back(e, vertex(at(n)), -share * cotangent[at(n)]);
  }
  SparseRows j(static_cast<Index>(mesh.edge_count()), static_cast<Index>(vertex_count));
  j.setFromTriplets(entries.begin(), entries.end());
  return j;
}

}  // namespace

bool ShortestSystem::solve(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                           const PennerAngles& angles, const std::vector<double>& wish,
                           std::vector<double>& direction, ExecutionContext& context) {
  const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
  const Eigen::Index n = vertex_count - 1;
  const SparseRows jt = vertex_derivatives(mesh, vertex_count, angles.cotangent);
  SparseRows cut = jt.leftCols(n);
  numeric::SparseMatrix symmetric;
  if (mesh.symmetric()) {
    symmetric = symmetric_changes(mesh, angles.cotangent);
    cut = SparseRows(symmetric.transpose()) * cut;
  }
  const numeric::SparseMatrix rows = numeric::SparseMatrix(cut.transpose());
  numeric::SparseMatrix product = rows * cut;
  product.makeCompressed();
  numeric::SparseMatrix lower = product.triangularView<Eigen::Lower>();
  lower.makeCompressed();
  cholesky_.analyze(lower, context);
  if (!cholesky_.factorize(lower, context)) return false;
  Eigen::VectorXd w =
      Eigen::Map<const Eigen::VectorXd>(wish.data(), static_cast<Eigen::Index>(wish.size()));
  if (mesh.symmetric()) {
    for (Eigen::Index e = 0; e < w.size(); ++e) {
      if (mesh.label_of_edge(static_cast<EdgeId>(e)) == intrinsic::EdgeLabel::kDiagonal) w[e] = 0.0;
    }
    w = symmetric.transpose() * w.eval();
  }
  const Eigen::Map<const Eigen::VectorXd> g(angles.vertices.value.data(), n);
  const Eigen::VectorXd right = g - rows * w;
  Eigen::VectorXd d = w;
  if (loops.size() > 0) {
    numeric::SparseMatrix q = loop_derivatives(mesh, loops, angles.cotangent);
    if (mesh.symmetric()) q = numeric::SparseMatrix(symmetric.transpose() * q);
    const Eigen::MatrixXd mixed = rows * q;
    const Eigen::MatrixXd x = cholesky_.solve(mixed, context);
    const Eigen::Map<const Eigen::VectorXd> f(angles.loops.data(),
                                              static_cast<Eigen::Index>(loops.size()));
    const Eigen::MatrixXd schur = Eigen::MatrixXd(q.transpose() * q) - mixed.transpose() * x;
    const Eigen::VectorXd m =
        numeric::solve_symmetric(schur, f - q.transpose() * w - x.transpose() * right);
    d += q * m;
    const Eigen::VectorXd rest = right - mixed * m;
    d += cut * cholesky_.solve(rest, context);
  } else {
    d += cut * cholesky_.solve(right, context);
  }
  if (mesh.symmetric()) d = symmetric * d.eval();
  direction.assign(d.data(), d.data() + d.size());
  return d.allFinite();
}

}  // namespace flipfree::seamless
