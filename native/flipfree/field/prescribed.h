// A cross field with the cones and turning numbers that are asked for, exactly: integers first,
// then the smoothest directions that go with them.
//
// Across edges along a chain the matching may be raised by one: the chain's first vertex loses a
// quarter turn, its last one gains it, and every loop that it crosses turns by one more. Chains of
// a tree of edges bring every vertex to its number, closed chains every loop (intrinsic/loops.h).
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/field/graph_system.h"

namespace flipfree::field {

// The smoothest directions for a given matching: that with the least rotation, a scalar Laplacian.
//
// With all that is topological fixed, angle(f) are the only unknowns, and sum w rotation^2 is
// quadratic in them: the trivial connection with these cones and turns (Crane, Desbrun, Schroeder
// 2010, "Trivial Connections on Discrete Surfaces"). Fixing the integers instead of solving for
// potentials on vertices and harmonic forms makes it exact by construction.

// The Laplacian of a surface's faces: held ones, and the first of a component without, keep their
// angle.
class AngleSystem {
 public:
  // `pull`: per face, how much it weighs that its direction stays; of a component without any,
  // and without held faces, the first face is held. `frames` must outlive this. Throws NotConverged
  // (kFactorizationFailed), Cancelled.
  AngleSystem(const Frames& frames, std::vector<char> held, std::vector<double> pull,
              ExecutionContext& context);

  // Turns the directions of `rotation` (3 #F, antisymmetric) so that sum w rotation^2 is least:
  // rotation(h) changes by turned(f) - turned(g); and, per face, pull (turned - wish)^2; no
  // wishes: 0. Result: turned, per face.
  Eigen::VectorXd solve(const std::vector<double>& rotation, const std::vector<double>& wish,
                        ExecutionContext& context) const;
  // Changes field.angle alone so that this is least; a wish means any of its four directions.
  void relax(const std::vector<double>& wish, CrossField& field, ExecutionContext& context) const;
  // A field near to this one that needs less rotation: relaxed, matched anew with the nearest, and
  // so on while that lowers the sum. A few rounds, each of them a solution.
  void descend(const std::vector<double>& wish, CrossField& field, ExecutionContext& context) const;
  // w, per half-edge.
  const std::vector<double>& weight() const { return weight_; }

 private:
  const Frames& frames_;
  std::vector<double> weight_;
  std::vector<double> pull_;
  std::optional<GraphSystem<double>> system_;
};

// `cones`: quarter turns per vertex, 4 where the field is regular, 2 on the boundary. Of a boundary
// loop with other numbers the sum is met, and where its corners lie is left to the directions; of
// one with twos alone, what Gauss-Bonnet and the loops leave. `loops`: with their turns; they
// are a basis of the homology, or some of one: what they leave open, or without any all, has the
// turns that need about the least rotation.
// Precondition: a valid surface. Throws Infeasible (kGaussBonnet) naming what is missing on
// a component, InvalidInput (kBadOption: loops that are no closed strips of faces, or that no
// field turns along so), NotConverged, Cancelled. Cost: a factorization, O(genus) solutions.
CrossField field_with_signature(const Frames& frames, const std::vector<Index>& cones,
                                const std::optional<std::vector<LoopTurn>>& loops,
                                ExecutionContext& context);

// Fewer and gentler cones: near pairs that cancel are merged, cones of one quarter turn share their
// curvature with a neighbour. Quarter turns are moved along chains of edges, so that the rest of
// the signature stays as it is (prescribed.h).

struct SimplifyOptions {
  double reach = 0.05;    // pairs nearer than this share of the square root of the area cancel
  Index least_turns = 2;  // cones of fewer quarter turns are spread
};

struct Simplified {
  Index cancelled = 0;  // quarter turns that were moved between cones of opposite sign
  Index spread = 0;     // quarter turns that were moved to a vertex that was regular
};

// Changes the matching, and the directions to the smoothest that go with it, but for faces that are
// `held` (flags). Nothing moves across the boundary, or along edges whose faces are both held.
// Cost: O(#V) and a search for every cone, and a factorization if anything was moved.
Simplified simplify(const Frames& frames, const std::vector<char>& held,
                    const SimplifyOptions& options, CrossField& field, ExecutionContext& context);

}  // namespace flipfree::field
