// Who finds the steps of a descent whose map has to meet constraints (minimizer.h).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"

namespace flipfree::distortion {

class StepSystem {
 public:
  StepSystem() = default;
  StepSystem(const StepSystem&) = delete;
  StepSystem& operator=(const StepSystem&) = delete;
  virtual ~StepSystem() = default;

  // Gradient and projected Hessian of the energy at `uv`, as far as steps are free. `soft`: see
  // symmetric_dirichlet_hessian(). Returns the energy. Same bits for any number of threads.
  virtual double assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                          ExecutionContext& context) = 0;
  // The Newton direction (#V x 2) among the steps that meet the constraints, zero on fixed
  // vertices; returns the gradient's product with it (<= 0). Throws NotConverged
  // (kFactorizationFailed).
  virtual double solve(Points2& direction, ExecutionContext& context) = 0;
};

}  // namespace flipfree::distortion
