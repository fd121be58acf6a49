// The smoothest cross field, free or guided.
//
// The u of unit length in the mean that minimises E is the first eigenvector (Knoeppel et al.
// 2013), found by Lanczos' iteration. But it fades away from where it is smoothest, on limbs until
// nothing is left but rounding, and so does the answer to wishes that are given in a few places. So
// both are where a flow begins that brings every cross back to unit length between its steps
// (Viertel, Osting 2019, "An Approach to Quad Meshing Based on Harmonic Cross-Valued Maps and the
// Ginzburg-Landau Theory"). All of it needs one factorization.
#pragma once

#include <complex>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::field {

// The smoothness of cross fields as a quadratic form (Knoeppel, Crane, Pinkall, Schroeder 2013,
// "Globally Optimal Direction Fields", with one number per face instead of per vertex).
//
// A cross in face f is the complex number u = exp(4 i angle(f)): its four directions have one.
// Across an edge it is carried by a unit number, t = exp(4 i (direction(h) - direction(o))), and
//
//   E(u) = sum over edges of w |u_f - t u_g|^2,  w: topology/weights.h

using Crosses = Eigen::VectorXcd;

// Crosses, and what ties them together: those of connected faces, or coarser ones (coarsen.h).
struct CrossGraph {
  struct Edge {
    Index f, g;  // nodes, f < g
    double weight;
    std::complex<double> carry;  // t: from g to f
  };
  std::vector<Edge> edges;   // sorted by f, then g
  std::vector<double> area;  // of each node; sum about 1
  std::vector<double> bent;  // of |u|^2, per node: what no u can have less
};
// A component of the surface: its nodes are these faces, ascending.
struct FaceGraph : CrossGraph {
  std::vector<FaceId> faces;
};

// One graph for each component of the surface. Cost: O(#F).
std::vector<FaceGraph> face_graphs(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                   const Frames& frames);

// E + (diagonal) as a matrix over the nodes that are not fixed, factorized.
class FieldSystem {
 public:
  // `diagonal`: per node, added to E. `fixed`: flags. False if it is not positive definite to
  // working precision.
  bool factorize(const CrossGraph& graph, const std::vector<double>& diagonal,
                 const std::vector<char>& fixed, ExecutionContext& context);
  // The u that minimises E(u) + sum of diagonal |u|^2 - 2 Re(conj(rhs) u), where fixed nodes keep
  // what `given` has there; rhs and given per node.
  Crosses solve(const Crosses& rhs, const Crosses& given, ExecutionContext& context) const;

 private:
  std::vector<Index> unknown_;  // per node; kInvalid if fixed
  Index count_ = 0;
  std::vector<CrossGraph::Edge> to_fixed_;  // edges with a fixed end
  numeric::SparseCholesky cholesky_;
};

// A graph of crosses with about half as many nodes: neighbours that are tied closest are taken for
// one, whose crosses are parallel. What is topological about a smooth field is decided far above
// the size of a triangle; all faces have their say when the directions are relaxed
// (prescribed/relax.h).

struct Coarsened {
  CrossGraph graph;
  // Per node of the finer graph: its node here, and u there = carry * u here.
  std::vector<Index> node;
  std::vector<std::complex<double>> carry;
};

// `alone`: flags of nodes that are not joined with others. E of a u that is constant on each pair
// is that of the coarser graph. Cost: O(nodes log nodes).
Coarsened coarsen(const CrossGraph& graph, const std::vector<char>& alone);

// What each face is asked for, per face of the surface.
struct Wishes {
  Crosses cross;               // unit numbers; anything where neither weight nor held
  std::vector<double> weight;  // of |u - cross|^2, per share of the component's area
  std::vector<char> held;      // u is the cross
};

// u of every face of the surface, component by component. Throws NotConverged
// (kFactorizationFailed), Cancelled. Cost: one factorization and some ten solutions for each.
Crosses smoothest(const std::vector<FaceGraph>& graphs, const Wishes& wishes,
                  ExecutionContext& context);

// What a cross field is asked to follow: curvature, sharp edges, the boundary.

// No wish at all.
Wishes no_wishes(Index faces);

// Principal directions, each weighing as much as the surface is curved differently along and across
// them: nothing on spheres and planes. `alignment` in [0, 1): 0 nothing, 0.5 as much as smoothness
// over a tenth of the surface's extent. Cost: O(#F).
void follow_curvature(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                      double alignment, Wishes& wishes);

// The faces beside flagged edges (mesh::flag_edges), and beside the boundary if asked. `weight` of
// a face that lies beside one, on the scale of `alignment`; 1: they are held. A face with several
// takes their mean, the longer ones weigh more. Cost: O(#F).
void follow_edges(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const Frames& frames, const mesh::EdgeFlags& edges, bool boundary, double weight,
                  Wishes& wishes);

// Fields for maps that are larger in some places than in others.
//
// Scaled by e^p, p varying, a map that follows a field has the field turn by *dp (thesis 6.3: a
// conformal change of the metric moves curvature, -laplace p, and with it where cones cost least).
// So the smoothest field for it is the one with the least rotation on the scaled surface.

// Sizing by how much the surface bends: a side as long as one over the square root of the curvature
// is as far off the surface everywhere. `share` of it in [0, 1]: of its logarithm; 0: 1 everywhere.
// Curvatures are means over a twentieth of the surface's extent, and at most kMostBent times more
// or less than the whole's. Cost: O(#F) times the rings of faces in there, 200 at most.
std::vector<double> curvature_sizing(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                     double share);

// One positive number per vertex, or none at all. Throws InvalidInput (kBadShape, kBadOption)
// naming the vertex.
void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface);

// The frames in which the field that the scaled surface is parallel in does not turn: directions
// of half-edges change by what the corners opposite of them say, corners stay. `sizing`: per
// vertex, positive; length in the map of a length 1 there. Cost: O(#F).
Frames sized_frames(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const Frames& frames, const std::vector<double>& sizing);

}  // namespace flipfree::field
