// The smoothness of cross fields as a quadratic form (Knoeppel, Crane, Pinkall, Schroeder 2013,
// "Globally Optimal Direction Fields", with one number per face instead of per vertex).
//
// A cross in face f is the complex number u = exp(4 i angle(f)): its four directions have one.
// Across an edge it is carried by a unit number, t = exp(4 i (direction(h) - direction(o))), and
//
//   E(u) = sum over edges of w |u_f - t u_g|^2,  w: topology/weights.h
#pragma once

#include <complex>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/topology/cross_field.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::field {

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

}  // namespace flipfree::field
