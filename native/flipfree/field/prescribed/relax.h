// The smoothest directions for a given matching: that with the least rotation, a scalar Laplacian.
//
// With all that is topological fixed, angle(f) are the only unknowns, and sum w rotation^2 is
// quadratic in them: the trivial connection with these cones and turns (Crane, Desbrun, Schroeder
// 2010, "Trivial Connections on Discrete Surfaces"). Fixing the integers instead of solving for
// potentials on vertices and harmonic forms makes it exact by construction.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/topology/cross_field.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::field {

// The Laplacian of a surface's faces: held ones, and the first of a component without, keep their
// angle.
class AngleSystem {
 public:
  // `pull`: per face, how much it weighs that its direction stays; of a component without any,
  // and without held faces, the first face is held. Throws NotConverged (kFactorizationFailed),
  // Cancelled.
  AngleSystem(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
              std::vector<char> held, std::vector<double> pull, ExecutionContext& context);

  // Turns the directions of `rotation` (3 #F, antisymmetric) so that sum w rotation^2 is least:
  // rotation(h) changes by turned(f) - turned(g); and, per face, pull (turned - wish)^2; no
  // wishes: 0. Result: turned, per face.
  std::vector<double> solve(const std::vector<double>& rotation, const std::vector<double>& wish,
                            ExecutionContext& context) const;
  // w, per half-edge.
  const std::vector<double>& weight() const { return weight_; }

 private:
  const mesh::Adjacency& adjacency_;
  std::vector<double> weight_;
  std::vector<double> pull_;
  std::vector<Index> unknown_;
  Index count_ = 0;
  numeric::SparseCholesky cholesky_;
};

// Changes field.angle alone, and lets wishes be.
void relax(const mesh::Adjacency& adjacency, const Frames& frames, const AngleSystem& system,
           CrossField& field, ExecutionContext& context);

// A field near to this one that needs less rotation: relaxed, matched anew with the nearest, and so
// on while that lowers the sum of w rotation^2 and of pull (angle - wish)^2, where a wish means any
// of its four directions. A few rounds, each of them a solution.
void descend(const mesh::Adjacency& adjacency, const Frames& frames, const AngleSystem& system,
             const std::vector<double>& wish, CrossField& field, ExecutionContext& context);

}  // namespace flipfree::field
