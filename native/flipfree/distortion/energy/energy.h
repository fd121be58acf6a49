// Sums of the energy over all triangles, flips, and the step to the first flip. All sums are taken
// per fixed chunk and combined in order: the same bits for any number of threads.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"

namespace flipfree::distortion {

// Weighted sums of |J|^2 / 4 (stretch) and |J^-1|^2 / 4 (shrink). Scaling the map by s makes them
// s^2 stretch and shrink / s^2; at the best s their sum is 2 sqrt(stretch shrink).
struct EnergySums {
  double stretch = 0;
  double shrink = 0;
  double worst_stretch = 0;  // largest of a triangle
  double worst_shrink = 0;
  double log_area = 0;  // weighted sum of log det J
  double value() const { return stretch + shrink; }
  double at_best_scale() const;
  // Factor by which to scale the map to reach it.
  double best_scale() const;
  // Bound on the f of every triangle at the best scale; at most twice the largest.
  double worst_at_best_scale() const;
};

// Precondition for all: every triangle of `uv` is positively oriented by the exact test.
EnergySums sum_energy(const Triangles& faces, const std::vector<RestTriangle>& rest,
                      const Points2& uv, const ExecutionContext& context);

// Derivative of the energy along `direction` (#V x 2).
double directional_derivative(const Triangles& faces, const std::vector<RestTriangle>& rest,
                              const Points2& uv, const Points2& direction,
                              const ExecutionContext& context);

// Smallest t > 0 at which uv + t direction collapses a triangle, in floating point; infinity if
// none does. An estimate for choosing a step, never a proof: the step is checked exactly
// afterwards.
double step_to_first_flip(const Triangles& faces, const Points2& uv, const Points2& direction,
                          const ExecutionContext& context);

// Exact: is every triangle positively oriented? Stops at the first that is not.
bool is_flip_free(const Triangles& faces, const Points2& uv, const ExecutionContext& context);
// Exact: the faces that are not, ascending.
std::vector<FaceId> flipped_faces(const Triangles& faces, const Points2& uv,
                                  const ExecutionContext& context);

}  // namespace flipfree::distortion
