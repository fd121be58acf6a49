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

#include <array>
#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/minimize/newton_system.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

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
  // Of a map.
  struct Value {
    double energy = 0;
    double least_determinant = std::numeric_limits<double>::infinity();  // of unguarded faces
  };
  void build_rest(const UntangleOptions& options, double target_area);
  Value value_of(const Points2& uv, const UntangleOptions& options, double epsilon,
                 const ExecutionContext& context) const;
  // The Newton step from uv, and the energy's slope along it.
  double find_step(const Points2& uv, const UntangleOptions& options, double epsilon, Points2& step,
                   ExecutionContext& context);

  const mesh::Surface& surface_;
  NewtonSystem system_;
  std::vector<RestTriangle> rest_;
};

}  // namespace flipfree::distortion
