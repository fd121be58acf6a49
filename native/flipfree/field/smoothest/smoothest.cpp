#include "flipfree/field/smoothest/smoothest.h"

#include <algorithm>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/field/smoothest/coarsen.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::field {
namespace {

// The flow's step: share of the component's area that it smooths over. Its inverse is added to E
// per area, for the eigenvector too: then one factorization does for both. Eigenvalues are some
// tens.
constexpr double kFlowArea = 0.01;
constexpr int kMostFlowSteps = 16;
// Larger graphs are coarsened first: faces in clusters are as good, relaxed afterwards.
constexpr std::size_t kEnoughNodes = 20'000;
// Mean change of a cross at which the flow ends.
constexpr double kSettled = 2e-3;
constexpr int kMostLanczosSteps = 24;
constexpr int kStepsBetweenChecks = 3;
// Of the eigenvalue: the vector is where the flow begins.
constexpr double kResidual = 1e-2;

[[noreturn]] void fail() {
  throw_not_converged(ErrorCode::kFactorizationFailed,
                      "The smoothest cross field could not be computed: the mesh has needles "
                      "beyond what 64-bit numbers hold. Improve its triangles.");
}

Eigen::Map<const Eigen::VectorXd> areas_of(const CrossGraph& graph) {
  return {graph.area.data(), static_cast<Eigen::Index>(graph.area.size())};
}

// Of the least eigenvalues, with the factor of E + area / kFlowArea: the first eigenvector, and
// what is known of the second, both of unit length in the mean.
struct Eigenvectors {
  Crosses first, second;
};
Eigenvectors least_eigenvectors(const CrossGraph& graph, const FieldSystem& system,
                                ExecutionContext& context) {
  const auto count = static_cast<Eigen::Index>(graph.area.size());
  const Eigen::VectorXd root = areas_of(graph).cwiseMax(1e-300).cwiseSqrt();
  // Lanczos: root B^-1 root, whose largest eigenvalue is wanted.
  const auto most = std::min<Eigen::Index>(kMostLanczosSteps, count);
  Eigen::MatrixXcd basis(count, most);
  Eigen::MatrixXd projected = Eigen::MatrixXd::Zero(most, most);
  basis.col(0) = root.cast<std::complex<double>>() / root.norm();
  const Crosses none = Crosses::Zero(count);
  for (Eigen::Index k = 0; k < most; ++k) {
    context.report("cross field", 0.5 + 0.25 * static_cast<double>(k) / static_cast<double>(most));
    Crosses next = system.solve(root.cwiseProduct(basis.col(k)), none, context).cwiseProduct(root);
    projected(k, k) = basis.col(k).dot(next).real();
    const Eigen::VectorXcd share = basis.leftCols(k + 1).adjoint() * next;
    next -= basis.leftCols(k + 1) * share;
    const double beta = next.norm();
    const bool last = k + 1 == most || beta <= 1e-12 * projected(0, 0);
    if (last || (k + 1) % kStepsBetweenChecks == 0) {
      const auto small =
          numeric::symmetric_eigen(Eigen::MatrixXd(projected.topLeftCorner(k + 1, k + 1)));
      const auto vector = [&](Eigen::Index i) -> Crosses {
        const Eigen::VectorXd share = small.vectors.col(i);
        return (basis.leftCols(k + 1) * share.cast<std::complex<double>>()).cwiseQuotient(root);
      };
      const double left = beta * std::abs(small.vectors(k, k));
      if (last || left <= kResidual * small.values[k])
        return {vector(k), vector(std::max<Eigen::Index>(k - 1, 0))};
    }
    projected(k, k + 1) = projected(k + 1, k) = beta;
    basis.col(k + 1) = next / beta;
  }
  fail();
}

void to_unit_length(Crosses& u) {
  for (Eigen::Index f = 0; f < u.size(); ++f) {
    const double length = std::abs(u[f]);
    if (length > 1e-290) u[f] /= length;
  }
}

// What the nodes of one graph are asked for.
struct Asked {
  Crosses pull;                // weight * area * wish
  std::vector<double> weight;  // times area
  std::vector<char> held;
  Crosses given;  // of held nodes
  bool any = false;
};

double energy(const CrossGraph& graph, const Crosses& u) {
  double sum = 0.0;
  for (const CrossGraph::Edge& e : graph.edges)
    sum += e.weight * std::norm(u[e.f] - e.carry * u[e.g]);
  return sum;
}

// The flow from crosses of unit length to where it changes them no more.
Crosses settled(const CrossGraph& graph, const Asked& asked, const FieldSystem& system, Crosses u,
                ExecutionContext& context) {
  const Eigen::VectorXd inertia = areas_of(graph) / kFlowArea;
  for (int step = 0; step < kMostFlowSteps; ++step) {
    context.report("cross field", 0.75 + 0.25 * step / kMostFlowSteps);
    Crosses next = system.solve(asked.pull + inertia.cwiseProduct(u), asked.given, context);
    to_unit_length(next);
    const double change = (next - u).cwiseAbs().dot(areas_of(graph));
    u = std::move(next);
    if (change < kSettled) break;
  }
  return u;
}

Crosses flow(const CrossGraph& graph, const Asked& asked, ExecutionContext& context) {
  std::vector<double> diagonal(asked.weight);
  for (std::size_t i = 0; i < diagonal.size(); ++i) diagonal[i] += graph.area[i] / kFlowArea;
  FieldSystem system;
  {
    const ProgressRange range(context, 0.0, 0.5);
    if (!system.factorize(graph, diagonal, asked.held, context)) fail();
  }
  const auto run = [&](Crosses u) {
    to_unit_length(u);
    return settled(graph, asked, system, std::move(u), context);
  };
  if (asked.any) return run(system.solve(asked.pull, asked.given, context));
  // The first eigenvector may be one of many, and one with cones that nobody wants: on a sphere of
  // meridians and parallels it has two without any angle. Mixed with the second it is another.
  const Eigenvectors start = least_eigenvectors(graph, system, context);
  Crosses one = run(start.first), other = run(start.first + start.second);
  return energy(graph, other) < energy(graph, one) ? other : one;
}

Asked restricted(const Asked& fine, const Coarsened& to) {
  const auto count = static_cast<Eigen::Index>(to.graph.area.size());
  Asked asked{Crosses::Zero(count), std::vector<double>(at(count), 0.0),
              std::vector<char>(at(count), 0), Crosses::Zero(count), fine.any};
  for (std::size_t i = 0; i < to.node.size(); ++i) {
    const Index node = to.node[i];
    const auto f = static_cast<Eigen::Index>(i);
    asked.pull[node] += std::conj(to.carry[i]) * fine.pull[f];
    asked.weight[at(node)] += fine.weight[i];
    if (fine.held[i] == 0) continue;
    asked.held[at(node)] = 1;
    asked.given[node] = fine.given[f];
  }
  return asked;
}

Crosses flow_coarsely(const CrossGraph& graph, const Asked& asked, ExecutionContext& context) {
  if (graph.area.size() <= kEnoughNodes) return flow(graph, asked, context);
  const Coarsened to = coarsen(graph, asked.held);
  // Where next to nothing was joined, because it is held, nothing is gained.
  if (to.graph.area.size() > graph.area.size() / 10 * 9) return flow(graph, asked, context);
  const Crosses coarse = flow_coarsely(to.graph, restricted(asked, to), context);
  Crosses u(static_cast<Eigen::Index>(to.node.size()));
  for (std::size_t i = 0; i < to.node.size(); ++i)
    u[static_cast<Eigen::Index>(i)] = to.carry[i] * coarse[to.node[i]];
  return u;
}

}  // namespace

Crosses smoothest(const std::vector<FaceGraph>& graphs, const Wishes& wishes,
                  ExecutionContext& context) {
  Crosses all(wishes.cross.size());
  double done = 0.0;
  for (const FaceGraph& graph : graphs) {
    const auto count = static_cast<Eigen::Index>(graph.faces.size());
    const double share = static_cast<double>(count) / static_cast<double>(all.size());
    const ProgressRange range(context, done, std::min(1.0, done + share));
    done += share;
    Asked asked{Crosses(count), std::vector<double>(at(count)), std::vector<char>(at(count)),
                Crosses::Zero(count)};
    for (Eigen::Index i = 0; i < count; ++i) {
      const FaceId f = graph.faces[at(i)];
      asked.weight[at(i)] = wishes.weight[at(f)] * graph.area[at(i)];
      asked.held[at(i)] = wishes.held[at(f)];
      asked.pull[i] = asked.weight[at(i)] * wishes.cross[f];
      if (asked.held[at(i)] != 0) asked.given[i] = wishes.cross[f];
      asked.any = asked.any || asked.weight[at(i)] > 0.0 || asked.held[at(i)] != 0;
    }
    const Crosses u = flow_coarsely(graph, asked, context);
    for (Eigen::Index i = 0; i < count; ++i) all[graph.faces[at(i)]] = u[i];
  }
  return all;
}

}  // namespace flipfree::field
