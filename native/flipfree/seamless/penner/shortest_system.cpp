#include "flipfree/seamless/penner/shortest_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>

namespace flipfree::seamless {

using intrinsic::IntrinsicMesh;

namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;

// Jv', #E x #V.
SparseRows vertex_derivatives(const IntrinsicMesh& mesh, const std::vector<double>& cotangent) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(4 * mesh.edge_count() + 2 * mesh.edge_count());
  for (std::size_t h = 0; h < cotangent.size(); ++h) {
    const HalfedgeId n = mesh.next[h], p = mesh.next[at(n)];
    const auto e = static_cast<Index>(h / 2);
    entries.emplace_back(e, mesh.origin[at(p)], cotangent[at(n)] + cotangent[at(p)]);
    entries.emplace_back(e, mesh.origin[h], -cotangent[at(p)]);
    entries.emplace_back(e, mesh.origin[at(n)], -cotangent[at(n)]);
  }
  SparseRows j(static_cast<Index>(mesh.edge_count()), static_cast<Index>(mesh.vertex_count()));
  j.setFromTriplets(entries.begin(), entries.end());
  return j;
}

}  // namespace

bool ShortestSystem::solve(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                           const PennerAngles& angles, const std::vector<double>& wish,
                           std::vector<double>& direction, ExecutionContext& context) {
  const auto n = static_cast<Eigen::Index>(mesh.vertex_count()) - 1;
  const SparseRows jt = vertex_derivatives(mesh, angles.cotangent);
  const SparseRows cut = jt.leftCols(n);
  const numeric::SparseMatrix rows = numeric::SparseMatrix(cut.transpose());
  numeric::SparseMatrix product = rows * cut;
  product.makeCompressed();
  numeric::SparseMatrix lower = product.triangularView<Eigen::Lower>();
  lower.makeCompressed();
  cholesky_.analyze(lower, context);
  if (!cholesky_.factorize(lower, context)) return false;
  const Eigen::Map<const Eigen::VectorXd> w(wish.data(), static_cast<Eigen::Index>(wish.size()));
  const Eigen::Map<const Eigen::VectorXd> g(angles.vertices.value.data(), n);
  const Eigen::VectorXd right = g - rows * w;
  Eigen::VectorXd d = w;
  if (loops.size() > 0) {
    const numeric::SparseMatrix q = loop_derivatives(mesh, loops, angles.cotangent);
    const Eigen::MatrixXd mixed = rows * q;
    const Eigen::MatrixXd x = cholesky_.solve(mixed, context);
    const Eigen::Map<const Eigen::VectorXd> f(angles.loops.data(),
                                              static_cast<Eigen::Index>(loops.size()));
    const Eigen::LDLT<Eigen::MatrixXd> schur(Eigen::MatrixXd(q.transpose() * q) -
                                             mixed.transpose() * x);
    const Eigen::VectorXd m = schur.solve(f - q.transpose() * w - x.transpose() * right);
    d += q * m;
    const Eigen::VectorXd rest = right - mixed * m;
    d += cut * cholesky_.solve(rest, context);
  } else {
    d += cut * cholesky_.solve(right, context);
  }
  direction.assign(d.data(), d.data() + d.size());
  return d.allFinite();
}

}  // namespace flipfree::seamless
