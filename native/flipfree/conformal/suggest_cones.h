// Suggest Cones: where to put the curvature so that a conformal map distorts scale no more than
// asked.
//
// Greedy, as Springborn, Schröder, Pinkall 2008 (section 6) and Ben-Chen, Gotsman, Bunin 2008: with
// u = 0 at the cones and flat elsewhere the curvature of the cones follows from the surface; the
// vertex with the most extreme u is the next cone. Placement uses the linear problem (the first
// Newton step), for which every new cone costs one solve with one factorization; then the true
// metric is computed, and cones are added at its extremes until the bound holds.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/newton_system.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {

// Cones of the linear conformal problem (the first Newton step): -L u = K - sum of charges, with
// u = 0 at base vertices. A charge is a cone's curvature.

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
  NewtonSystem laplacian_;
  std::vector<double> free_;
  std::vector<std::vector<double>> green_;
};

// Cones whose curvatures are multiples of a quantum, such that the scale factor stays within a
// bound: a search over integers.
//
// A cone of a quarter turn is felt as log(distance / mesh size) / 4 in u around it, so cones that
// are rounded one by one leave peaks where two of opposite sign lie side by side. The search moves
// single quanta: the vertex with the largest u gives one away, or the one with the smallest u
// receives one, in exchange with the other extreme or a cone near by, whichever lowers the spread
// of u most. u responds linearly (Green's functions); the true metric is computed in between, and
// has the last word.

using ConeSteps = std::map<VertexId, int>;  // curvature of each cone, quanta; none is zero

struct ConeSearch {
  double quantum = 0.0;
  int most_steps = 3;     // of one cone: its angle stays positive
  bool balanced = false;  // no boundary takes what cones lack: their sum is fixed
  double allowed = 0.0;   // range of u
  Index max_cones = 200;
  std::vector<char> fixed;  // vertices that cannot be cones (the boundary)
};

struct TrueScale {
  std::vector<double> u;  // empty: the metric was not reached
  double range = 0.0;
};

struct FoundCones {
  ConeSteps cones;
  double range = 0.0;  // of the true metric
};

struct SuggestConesOptions {
  // Largest allowed ratio between the largest and the smallest scale (length) factor over all
  // vertices; > 1.
  double bound = 4.0;
  Index max_cones = 200;
  // Round cone curvatures to multiples of this (radians), e.g. pi / 2 for seamless maps; 0 = as
  // they are. Rounded cones are searched for (cone_rounding.h) until the bound holds; whether it
  // does, the result says.
  double quantum = 0.0;
  // No suggested cone is sharper than this total angle.
  double least_angle = 0.5235987755982988;  // pi / 6
  // 0 = never. When they are over the best cones whose metric was measured are returned.
  double max_seconds = 0.0;
  // The same, but where there are no such cones yet the search goes on until there are.
  double enough_seconds = 0.0;
};

struct SuggestedCones {
  std::vector<double>
      target_angles;  // #V, ready for conformal(): Gauss-Bonnet holds, boundary free (u = 0)
  std::vector<VertexId> cones;  // in the order in which they were placed
  double scale_ratio = 0.0;     // measured on the metric of target_angles
  bool bound_holds = false;     // scale_ratio <= bound
};

// Errors: InvalidInput (surface, options), NotConverged when max_cones, or the time
// (kTimeLimit), do not suffice even for positive angles, Cancelled. Cost: a factorization, one
// solve per cone, a few conformal metrics.
SuggestedCones suggest_cones(const mesh::Surface& surface, const SuggestConesOptions& options,
                             ExecutionContext& context);

}  // namespace flipfree::conformal
