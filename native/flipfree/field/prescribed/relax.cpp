#include "flipfree/field/prescribed/relax.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/field/topology/weights.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::field {
namespace {

// Pulls of a smaller share of the weights of a component's edges do not hold it against rounding.
constexpr double kHolds = 1e-9;

}  // namespace

AngleSystem::AngleSystem(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                         std::vector<char> held, std::vector<double> pull,
                         ExecutionContext& context)
    : adjacency_(adjacency),
      weight_(edge_weights(surface, adjacency, face_areas(surface))),
      pull_(std::move(pull)) {
  const mesh::Components components = mesh::face_components(adjacency);
  std::vector<char> anchored(at(components.count), 0);
  std::vector<double> pulled(at(components.count), 0.0), joined(at(components.count), 0.0);
  for (std::size_t f = 0; f < held.size(); ++f) {
    const std::size_t part = at(components.of_face[f]);
    if (held[f] != 0) anchored[part] = 1;
    pulled[part] += pull_[f];
    for (std::size_t h = 3 * f; h < 3 * f + 3; ++h) joined[part] += weight_[h];
  }
  for (std::size_t part = 0; part < anchored.size(); ++part) {
    if (pulled[part] > kHolds * joined[part]) anchored[part] = 1;
  }
  for (std::size_t f = 0; f < held.size(); ++f) {
    char& done = anchored[at(components.of_face[f])];
    if (done == 0) held[f] = done = 1;
  }
  unknown_.assign(held.size(), kInvalid);
  for (std::size_t f = 0; f < held.size(); ++f) {
    if (held[f] == 0) unknown_[f] = count_++;
  }
  if (count_ == 0) return;
  std::vector<Index> start{0}, row;
  std::vector<double> value;
  for (std::size_t f = 0; f < held.size(); ++f) {
    if (held[f] != 0) continue;
    double own = pull_[f];
    std::array<std::pair<Index, double>, 3> later{};
    int count = 0;
    for (HalfedgeId h = 3 * static_cast<Index>(f); h < 3 * static_cast<Index>(f) + 3; ++h) {
      own += weight_[at(h)];
      const HalfedgeId o = adjacency.opposite[at(h)];
      const Index g = o == kInvalid ? kInvalid : unknown_[at(o / 3)];
      if (g <= unknown_[f]) continue;
      // Kept in order; two faces may share two edges.
      int k = 0;
      while (k < count && later[at(k)].first < g) ++k;
      if (k == count || later[at(k)].first != g) {
        for (int i = count++; i > k; --i) later[at(i)] = later[at(i - 1)];
        later[at(k)] = {g, 0.0};
      }
      later[at(k)].second -= weight_[at(h)];
    }
    row.push_back(unknown_[f]);
    value.push_back(own);
    for (int k = 0; k < count; ++k) {
      row.push_back(later[at(k)].first);
      value.push_back(later[at(k)].second);
    }
    start.push_back(static_cast<Index>(row.size()));
  }
  const numeric::SparseMatrix lower =
      Eigen::Map<const numeric::SparseMatrix>(count_, count_, static_cast<Eigen::Index>(row.size()),
                                              start.data(), row.data(), value.data());
  cholesky_.analyze(lower, context);
  if (!cholesky_.factorize(lower, context)) {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The field with this signature could not be computed: the mesh has "
                        "needles beyond what 64-bit numbers hold. Improve its triangles.");
  }
}

std::vector<double> AngleSystem::solve(const std::vector<double>& rotation,
                                       const std::vector<double>& wish,
                                       ExecutionContext& context) const {
  std::vector<double> turned(unknown_.size(), 0.0);
  if (count_ == 0) return turned;
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(count_, 1);
  for (HalfedgeId h = 0; at(h) < rotation.size(); ++h) {
    const Index f = unknown_[at(h / 3)];
    if (f != kInvalid && adjacency_.opposite[at(h)] != kInvalid)
      rhs(f, 0) -= weight_[at(h)] * rotation[at(h)];
  }
  for (std::size_t f = 0; f < wish.size(); ++f) {
    if (unknown_[f] != kInvalid) rhs(unknown_[f], 0) += pull_[f] * wish[f];
  }
  const Eigen::MatrixXd x = cholesky_.solve(rhs, context);
  for (std::size_t f = 0; f < unknown_.size(); ++f) {
    if (unknown_[f] != kInvalid) turned[f] = x(unknown_[f], 0);
  }
  return turned;
}

void relax(const mesh::Adjacency& adjacency, const Frames& frames, const AngleSystem& system,
           CrossField& field, ExecutionContext& context) {
  const std::vector<double> turned =
      system.solve(rotation_form(adjacency, frames, field), {}, context);
  for (std::size_t f = 0; f < turned.size(); ++f) field.angle[f] += turned[f];
}

void descend(const mesh::Adjacency& adjacency, const Frames& frames, const AngleSystem& system,
             const std::vector<double>& wish, CrossField& field, ExecutionContext& context) {
  // Every round lowers the sum: relaxing is a minimum, and the nearest matching the least rotation.
  constexpr int kMostRounds = 5;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<double> offset(wish.size());
    for (std::size_t f = 0; f < wish.size(); ++f)
      offset[f] = std::remainder(wish[f] - field.angle[f], 0.5 * std::numbers::pi);
    const std::vector<double> turned =
        system.solve(rotation_form(adjacency, frames, field), offset, context);
    for (std::size_t f = 0; f < turned.size(); ++f) field.angle[f] += turned[f];
    CrossField next = match_nearest(adjacency, frames, field.angle);
    const bool same = next.matching == field.matching;
    field = std::move(next);
    if (same) break;
  }
}

}  // namespace flipfree::field
