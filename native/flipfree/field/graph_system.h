// The connection Laplacian of a graph, with some of its nodes fixed: over real numbers for angles,
// over complex ones for crosses (Knoeppel, Crane, Pinkall, Schroeder 2013, "Globally Optimal
// Direction Fields").
//
//   E(u) = sum over edges of weight |u_f - carry u_g|^2
#pragma once

#include <complex>
#include <tuple>
#include <type_traits>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::field {

template <typename Value>
struct GraphEdge {
  Index f, g;  // nodes, f < g
  double weight;
  Value carry;  // from g to f, of length 1
  bool operator<(const GraphEdge& other) const {
    return std::tie(f, g) < std::tie(other.f, other.g);
  }
};

template <typename Value>
class GraphSystem {
 public:
  using Values = Eigen::Matrix<Value, Eigen::Dynamic, 1>;

  // `diagonal`: of the matrix, per node: the weights of its edges, and what is added to E of |u|^2.
  // `fixed`: flags. Throws NotConverged (kFactorizationFailed), Cancelled.
  GraphSystem(const std::vector<GraphEdge<Value>>& edges, const std::vector<double>& diagonal,
              const std::vector<char>& fixed, ExecutionContext& context)
      : unknown_(fixed.size(), kInvalid) {
    std::vector<Eigen::Triplet<double, Index>> entries;
    const auto add_block = [&](Index f, Index g, Value value) {
      if constexpr (kParts == 1) {
        entries.emplace_back(g, f, value);
      } else {
        entries.emplace_back(2 * g, 2 * f, value.real());
        entries.emplace_back(2 * g + 1, 2 * f, -value.imag());
        if (f != g) entries.emplace_back(2 * g, 2 * f + 1, value.imag());
        entries.emplace_back(2 * g + 1, 2 * f + 1, value.real());
      }
    };
    for (std::size_t f = 0; f < fixed.size(); ++f) {
      if (fixed[f] != 0) continue;
      unknown_[f] = count_++;
      add_block(unknown_[f], unknown_[f], diagonal[f]);
    }
    for (const GraphEdge<Value>& e : edges) {
      const Index f = unknown_[at(e.f)], g = unknown_[at(e.g)];
      if (f != kInvalid && g != kInvalid) {
        add_block(f, g, -e.weight * e.carry);
      } else if (f != g) {
        to_fixed_.push_back(e);
      }
    }
    if (count_ == 0) return;
    numeric::SparseMatrix lower(kParts * count_, kParts * count_);
    lower.setFromTriplets(entries.begin(), entries.end());
    cholesky_.analyze(lower, context);
    if (!cholesky_.factorize(lower, context)) {
      throw_not_converged(ErrorCode::kFactorizationFailed,
                          "The cross field could not be computed: the mesh has needles beyond "
                          "what 64-bit numbers hold. Improve its triangles.");
    }
  }

  // The u that minimises E(u) + what was added - 2 Re(conj(rhs) u), where fixed nodes keep what
  // `given` has there; rhs and given per node.
  Values solve(const Values& rhs, const Values& given, ExecutionContext& context) const {
    Values result = given;
    if (count_ == 0) return result;
    Values own(count_);
    for (std::size_t f = 0; f < unknown_.size(); ++f) {
      if (unknown_[f] != kInvalid) own[unknown_[f]] = rhs[static_cast<Eigen::Index>(f)];
    }
    for (const GraphEdge<Value>& e : to_fixed_) {
      if (unknown_[at(e.f)] != kInvalid) {
        own[unknown_[at(e.f)]] += e.weight * e.carry * given[e.g];
      } else {
        own[unknown_[at(e.g)]] += e.weight * Eigen::numext::conj(e.carry) * given[e.f];
      }
    }
    const Eigen::Map<const Eigen::MatrixXd> flat(reinterpret_cast<const double*>(own.data()),
                                                 kParts * count_, 1);
    const Eigen::MatrixXd x = cholesky_.solve(flat, context);
    const Eigen::Map<const Values> solved(reinterpret_cast<const Value*>(x.data()), count_);
    for (std::size_t f = 0; f < unknown_.size(); ++f) {
      if (unknown_[f] != kInvalid) result[static_cast<Eigen::Index>(f)] = solved[unknown_[f]];
    }
    return result;
  }

 private:
  static constexpr Index kParts = std::is_same_v<Value, double> ? 1 : 2;

  std::vector<Index> unknown_;  // per node; kInvalid if fixed
  Index count_ = 0;
  std::vector<GraphEdge<Value>> to_fixed_;  // edges with a fixed end
  numeric::SparseCholesky cholesky_;
};

}  // namespace flipfree::field
