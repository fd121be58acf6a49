// Makes a map flip-free that is not, with some vertices held where they are: a search, without
// guarantee, that is exact in its verdict. The first try in front of MatchMaker++, and the way back
// from its refined maps to the user's triangles.
//
// Based on: Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov, "Foldover-free maps in 50 lines
// of code" (2021). Per triangle with Jacobian J, d = det J:
//
//   f(J) = (|J|^2 + lambda (d^2 + 1)) / chi(d, eps),    chi(d, eps) = (d + sqrt(d^2 + eps^2)) / 2,
//
// finite for flipped triangles as long as eps > 0; eps falls with the progress made, as in their
// section 3. Deviation: projected Newton on all free vertices (eigenvalues of the 4 x 4 Hessian in
// J clamped) instead of L-BFGS.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/minimize/newton_system.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

namespace foldover_free {

// J as (J00, J01, J10, J11): row = coordinate of the map, column = coordinate of the rest triangle.
using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

// Gradient and clamped Hessian of f with respect to J. With D the matrix of the determinant, C = D
// J the cofactors, J = P + M its similarity and anti-similarity parts (D P = P, D M = -M), the
// Hessian is
//   a I + b D + p (J C' + C J') + q C C',
// which has the eigenvalues a + b and a - b across P and M in their planes, and mixes P and M
// alone.
void derivatives(const Vector4& j, double lambda, double epsilon, Vector4& gradient,
                 Matrix4& hessian);

}  // namespace foldover_free

struct UntangleOptions {
  int max_iterations = 200;
  // Give up when the worst triangle has not improved for so many iterations although eps is small.
  int patience = 60;
  // eps falls no lower: what can't be unfolded does not squeeze the rest without bound.
  double least_epsilon = 1e-10;
  // How fast eps may fall once the energy is minimised for it, in (0, 1): faster ends sooner,
  // slower folds less.
  double pace = 0.4;
  // Newton steps after the map has become flip-free, which spread what is still squeezed.
  int extra_iterations = 2;
  double lambda = 0.1;
  // Area of the whole map at which triangles are at rest; 0: the absolute area of the initial map.
  double target_area = 0.0;
  // Rest triangles are raised to this height, as a share of their longest edge.
  double least_height = 0.1;
  // Faces [0, guards) are positive at the start and stay so, at any eps: a barrier. The others may
  // overlap them.
  Index guards = 0;
  // Of each face's energy (#F), beside its area; null: all the same.
  const std::vector<double>* weights = nullptr;
  // The shape at which each face is at rest (#F); null: its shape on the surface.
  const std::vector<std::array<Vector2, 3>>* shapes = nullptr;
};

struct UntangleResult {
  Points2 uv;
  Index flips = -1;  // by exact test; 0 = success
  int iterations = 0;
};

class Untangler {
 public:
  // `fixed`: one entry per vertex. Builds the pattern and its symbolic factorization once. The
  // surface must outlive it.
  Untangler(const mesh::Surface& surface, const std::vector<char>& fixed,
            ExecutionContext& context);
  // initial: #V x 2, any finite values. Fixed vertices keep theirs bit for bit.
  UntangleResult run(const Points2& initial, const UntangleOptions& options,
                     ExecutionContext& context);

 private:
  const mesh::Surface& surface_;
  NewtonSystem system_;
};

}  // namespace flipfree::distortion
