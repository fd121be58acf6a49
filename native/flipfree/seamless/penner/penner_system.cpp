#include "flipfree/seamless/penner/penner_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/base/debug_check.h"
#include "flipfree/base/parallel.h"
#include "flipfree/seamless/bordered/symmetric_changes.h"

namespace flipfree::seamless {

using intrinsic::IntrinsicMesh;

namespace {

constexpr std::size_t kFacesPerChunk = 4096;

// The sides after a half-edge in its face.
struct OtherSides {
  std::size_t next, previous;
};
OtherSides other_sides(const IntrinsicMesh& mesh, std::size_t h) {
  const HalfedgeId n = mesh.next[h];
  return {at(n), at(mesh.next[at(n)])};
}

Index unknown_at(const IntrinsicMesh& mesh, std::size_t h) {
  return mesh.unknown[at(mesh.origin[h])];
}

// B' r, column by column.
Eigen::MatrixXd by_vertices(const IntrinsicMesh& mesh, Eigen::Index vertex_count,
                            const numeric::SparseMatrix& r) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(vertex_count, r.cols());
  for (Index i = 0; i < r.cols(); ++i) {
    for (numeric::SparseMatrix::InnerIterator entry(r, i); entry; ++entry) {
      const std::size_t h = 2 * at(entry.index());
      a(unknown_at(mesh, h), i) += 0.5 * entry.value();
      a(unknown_at(mesh, h + 1), i) += 0.5 * entry.value();
    }
  }
  return a;
}

// r -= Jv' x, column by column.
void subtract_vertex_part(const IntrinsicMesh& mesh, const std::vector<double>& cotangent,
                          const Eigen::MatrixXd& x, Eigen::MatrixXd& r,
                          const ExecutionContext& context) {
  const double share = face_share(mesh);
  parallel_for(context, static_cast<std::size_t>(r.cols()), 1,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (std::size_t c = begin; c < end; ++c) {
                   const auto column = static_cast<Eigen::Index>(c);
                   const double* v = x.col(column).data();
                   double* out = r.col(column).data();
                   for (std::size_t h = 0; h < cotangent.size(); ++h) {
                     const auto [n, p] = other_sides(mesh, h);
                     const double source = v[unknown_at(mesh, h)], target = v[unknown_at(mesh, n)],
                                  apex = v[unknown_at(mesh, p)];
                     out[h / 2] -=
                         share * (cotangent[n] * (apex - target) + cotangent[p] * (apex - source));
                   }
                 }
               });
}

// Jv s.
Eigen::VectorXd vertex_change(const IntrinsicMesh& mesh, Eigen::Index vertex_count,
                              const std::vector<double>& cotangent, const Eigen::VectorXd& s) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(vertex_count);
  const auto of = [&](std::size_t h) { return s[static_cast<Eigen::Index>(h / 2)]; };
  for (std::size_t h = 0; h < cotangent.size(); ++h) {
    const auto [n, p] = other_sides(mesh, h);
    change[unknown_at(mesh, p)] += cotangent[n] * (of(h) - of(p)) + cotangent[p] * (of(h) - of(n));
  }
  return face_share(mesh) * change;
}

// Columns that sum to zero, as right-hand sides of the Laplacian must: what rounding adds would all
// land on the fixed vertex.
void remove_means(Eigen::MatrixXd& columns) {
  columns.rowwise() -= columns.colwise().mean().eval();
}

}  // namespace

numeric::SparseMatrix loop_derivatives(const IntrinsicMesh& mesh,
                                       const intrinsic::LoopCarrier& loops,
                                       const std::vector<double>& cotangent) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto column = static_cast<Index>(i);
    loops.visit_corners(i, [&](const intrinsic::PassedCorner& corner) {
      const auto h = at(corner.opposite);
      const auto [n, p] = other_sides(mesh, h);
      const auto add = [&](std::size_t g, double value) {
        entries.emplace_back(static_cast<Index>(g / 2), column, corner.sign * value);
      };
      add(h, cotangent[n] + cotangent[p]);
      add(n, -cotangent[p]);
      add(p, -cotangent[n]);
    });
  }
  numeric::SparseMatrix r(static_cast<Index>(mesh.edge_count()), static_cast<Index>(loops.size()));
  r.setFromTriplets(entries.begin(), entries.end());
  return r;
}

void require_same_mesh(const conformal::MetricEngine& engine, const intrinsic::LoopCarrier& loops) {
  debug_require("loops and metric", "they have one triangulation",
                [&] { return loops.mesh().next == engine.mesh().next; });
}

void measure(const conformal::MetricEngine& engine, const intrinsic::LoopCarrier& loops,
             const PennerTargets& targets, PennerAngles& out, ExecutionContext& context) {
  const IntrinsicMesh& mesh = engine.mesh();
  std::vector<double> tangent;
  engine.half_tangents(tangent, context);
  const std::size_t count = tangent.size();
  out.cotangent.resize(count);
  out.vertices.half_cotangent.resize(count);
  std::vector<double> angle(count);
  const double share = face_share(mesh);
  parallel_for(context, count, 3 * kFacesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (std::size_t h = begin; h < end; ++h) {
                   const double t = tangent[h];
                   angle[h] = 2.0 * std::atan(t);
                   out.cotangent[h] = 0.5 * (1.0 / t - t);
                   out.vertices.half_cotangent[h] = 0.5 * share * out.cotangent[h];
                 }
               });
  out.vertices.value = targets.vertex_angle;
  for (std::size_t h = 0; h < count; ++h)
    out.vertices.value[at(unknown_at(mesh, other_sides(mesh, h).previous))] -= share * angle[h];
  out.loops = targets.loop_angle;
  for (std::size_t i = 0; i < out.loops.size(); ++i) {
    loops.visit_corners(i, [&](const intrinsic::PassedCorner& corner) {
      out.loops[i] -= corner.sign * angle[at(corner.opposite)];
    });
  }
  double largest = 0.0, squares = 0.0;
  for (const auto* errors : {&out.vertices.value, &out.loops}) {
    for (const double error : *errors) {
      const double size =
          std::isfinite(error) ? std::abs(error) : std::numeric_limits<double>::infinity();
      largest = std::max(largest, size);
      squares += size * size;
    }
  }
  out.vertices.max_error = largest;
  out.max_error = largest;
  out.norm = std::sqrt(squares);
}

bool PennerSystem::prepare(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                           const PennerAngles& angles, ExecutionContext& context) {
  if (!std::isfinite(angles.max_error)) return false;
  if (!laplacian_.factorize(mesh, angles.vertices, context)) return false;
  if (loops.size() == 0) return true;
  const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
  const numeric::SparseMatrix r = loop_derivatives(mesh, loops, angles.cotangent);
  Eigen::MatrixXd a = by_vertices(mesh, vertex_count, r);
  remove_means(a);
  x_ = -laplacian_.solve_columns(a, context);
  q_ = r;
  subtract_vertex_part(mesh, angles.cotangent, x_, q_, context);
  if (mesh.symmetric()) {
    numeric::SparseMatrix symmetric = symmetric_changes(mesh, angles.cotangent);
    symmetric_.swap(symmetric);
    q_ = symmetric_.transpose() * q_.eval();
  }
  gram_.setZero(q_.cols(), q_.cols());
  gram_.selfadjointView<Eigen::Lower>().rankUpdate(q_.transpose());
  return true;
}

bool PennerSystem::solve(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                         const PennerAngles& angles, PennerDirection& direction,
                         ExecutionContext& context) {
  return prepare(mesh, loops, angles, context) && solve_prepared(mesh, angles, direction, context);
}

bool PennerSystem::solve_prepared(const IntrinsicMesh& mesh, const PennerAngles& angles,
                                  PennerDirection& direction, ExecutionContext& context) const {
  const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
  const Eigen::Map<const Eigen::VectorXd> g(angles.vertices.value.data(), vertex_count);
  Eigen::MatrixXd right = -g;
  Eigen::VectorXd s = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(mesh.edge_count()));
  if (!angles.loops.empty()) {
    const Eigen::Map<const Eigen::VectorXd> f(angles.loops.data(),
                                              static_cast<Eigen::Index>(angles.loops.size()));
    s = q_ * Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower>(gram_).solve(f - x_.transpose() * g);
    if (mesh.symmetric()) s = symmetric_ * s.eval();
    right += vertex_change(mesh, vertex_count, angles.cotangent, s);
  }
  remove_means(right);
  const Eigen::MatrixXd u = laplacian_.solve_columns(right, context);
  direction.scale.assign(u.data(), u.data() + vertex_count);
  direction.stretch.assign(s.data(), s.data() + s.size());
  direction.scale_range = u.maxCoeff() - u.minCoeff();
  direction.most_stretch = s.cwiseAbs().maxCoeff();
  const double middle = 0.5 * (u.maxCoeff() + u.minCoeff());
  for (double& value : direction.scale) value -= middle;
  return std::isfinite(direction.scale_range) && std::isfinite(direction.most_stretch);
}

Eigen::MatrixXd PennerSystem::norm_of_turns() const {
  return Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower>(gram_).solve(
      Eigen::MatrixXd::Identity(gram_.rows(), gram_.cols()));
}

}  // namespace flipfree::seamless
