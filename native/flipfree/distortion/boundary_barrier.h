// Barrier that keeps a chart's boundary from meeting itself: for every boundary vertex p and
// boundary edge ab that does not end in p, (h / d - 1)^2 where their distance d is below h, after
// Smith, Schaefer 2015, "Bijective Parameterization with Free Boundaries". It only steers; what is
// accepted is decided by the exact test of boundary_grid.h.
#pragma once

#include <array>
#include <vector>

#include "flipfree/distortion/boundary_grid.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

class BoundaryBarrier {
 public:
  explicit BoundaryBarrier(const Surface& chart);

  const Boundary& boundary() const { return boundary_; }

  // A pair within reach, and the derivatives of its term: gradient and Gauss-Newton Hessian are
  // slope * (n, -(1 - t) n, -t n) and curvature * the outer product of the same; both weighted.
  struct Contact {
    std::array<VertexId, 3> vertices;  // p, a, b
    Vector2 normal;                    // n: unit, from the closest point a + t (b - a) to p
    double t = 0;
    double value = 0;
    double slope = 0;
    double curvature = 0;
  };
  // scale: UV length of a surface length 1. weight: of each term. Order of the contacts: by p, then
  // edge.
  std::vector<Contact> contacts(const Points2& uv, double scale, double weight) const;
  // Vertex pairs (lower first, sorted, unique) that contacts couple while no distance changes by
  // more than half of the reach; edges of the boundary are not listed.
  std::vector<std::array<VertexId, 2>> couplings(const Points2& uv, double scale) const;
  // Sum of the values of the contacts.
  double value(const Points2& uv, double scale, double weight) const;

 private:
  template <typename Visit>
  void for_contacts(const Points2& uv, double reach_scale, double weight, Visit visit) const;

  Boundary boundary_;
  std::vector<double> edge_reach_;    // per boundary edge, surface lengths
  std::vector<double> vertex_reach_;  // per entry of boundary_.vertices
};

}  // namespace flipfree::distortion
