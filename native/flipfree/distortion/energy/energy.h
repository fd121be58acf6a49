// Sums of the energy over all triangles, flips, and the step to the first flip. All sums are taken
// per fixed chunk and combined in order: the same bits for any number of threads.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// Rest shapes: each surface triangle unfolded into the plane, normalised to total area 1.

// Rest triangles lower than this share of their longest edge are raised to it: the gradients of a
// needle would drown the entries of its neighbours in rounding. Its weight stays the true area, so
// that energies of meshes with slivers change by less than the slivers' share of the surface.
inline constexpr double kFlattestRest = 1e-7;
// Least weight of a triangle as a share of the mean weight. A triangle of no area would resist
// nothing until it is about to flip, and then stop the line search for all others.
inline constexpr double kLeastWeight = 1e-3;

// The triangle unfolded into the plane, its longest edge on the x axis, raised to `least_height` of
// that. Its weight is twice the true area.
RestTriangle unfold(const std::array<Vector3, 3>& point, double least_height);
// Its lengths divided by `scale`.
RestTriangle scaled(RestTriangle rest, double scale);

struct RestShapes {
  std::vector<RestTriangle> triangles;  // #F, lengths divided by `length`; weights sum to 1
  double length = 1;                    // square root of the surface's area
};

// Precondition: coordinates are finite and the surface has positive area.
RestShapes build_rest_shapes(const mesh::Surface& surface, const ExecutionContext& context);

// So many equilateral triangles of side 1 and of equal weight: for opening triangles in the plane,
// whatever they look like on the surface.
RestShapes equilateral_rest_shapes(std::size_t count);

// Rest shapes that one Newton step sees: the true ones at the best scale, or, while the map is far
// from them, shapes between the map and the target with bounded distortion (Liu, Ye, Ni, Fu 2018,
// section 4).

// Bound on f of each triangle with respect to its intermediate rest shape: the figure of the paper.
inline constexpr double kProgressiveBound = 4.6;

// All rest lengths divided by `scale`.
std::vector<RestTriangle> scaled_rest(const std::vector<RestTriangle>& rest, double scale,
                                      const ExecutionContext& context);

// The same, then every rest shape whose f exceeds kProgressiveBound is drawn towards the current UV
// triangle along its singular directions (J = U S V' becomes U S^t V') until f = kProgressiveBound.
// Weights become uniform, as the share of the surface says nothing about how hard a triangle is to
// untangle.
std::vector<RestTriangle> progressive_rest(const Triangles& faces,
                                           const std::vector<RestTriangle>& rest, double scale,
                                           const Points2& uv, const ExecutionContext& context);

// How work on all faces is split between threads in this stage.

// Faces that one thread takes at a time: a fraction of a millisecond. Sums are taken per grain, so
// that the bits of results depend on it. benchmarks/unwrap.py scale measures it.
inline constexpr std::size_t kGrain = 8192;

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

// Exact: is every triangle positively oriented?
bool is_flip_free(const Triangles& faces, const Points2& uv, const ExecutionContext& context);
// Exact: the faces that are not, ascending.
std::vector<FaceId> flipped_faces(const Triangles& faces, const Points2& uv,
                                  const ExecutionContext& context);

}  // namespace flipfree::distortion
