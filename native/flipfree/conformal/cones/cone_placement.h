// Cones of the linear conformal problem (the first Newton step): -L u = K - sum of charges, with
// u = 0 at base vertices. A charge is a cone's curvature.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/metric/pinned_metric.h"

namespace flipfree::conformal {

class LinearPlacement {
 public:
  // `gradient`: evaluated at u = 0 with flat targets, so its value is the curvature K of the
  // surface. `base`: one flag per vertex, at least one set. Throws NotConverged if the Laplacian
  // cannot be factorized.
  LinearPlacement(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                  std::vector<char> base, ExecutionContext& context);

  // Puts a cone at v, with u = 0 there, and updates u and charge.
  void add(VertexId v, ExecutionContext& context);
  // The vertex that is neither pinned nor a cone with the largest |u|; kInvalid if u = 0.
  VertexId extreme() const;
  // Largest minus smallest u, the base's zero included.
  double range() const;
  // What the base bears.
  double base_charge() const { return total_curvature - charge.sum(); }
  // Potential of a unit charge at v.
  std::vector<double> response(VertexId v, ExecutionContext& context) const;

  std::vector<double> u;
  std::vector<VertexId> cones;
  Eigen::VectorXd charge;        // per cone
  double total_curvature = 0.0;  // of the surface

 private:
  std::vector<char> base_;
  PinnedLaplacian laplacian_;
  std::vector<double> free_;
  std::vector<std::vector<double>> green_;
};

}  // namespace flipfree::conformal
