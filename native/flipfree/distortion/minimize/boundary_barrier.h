// Barrier that keeps a chart's boundary from meeting itself: for every boundary vertex p and
// boundary edge ab that does not end in p, (h / d - 1)^2 where their distance d is below h, after
// Smith, Schaefer 2015, "Bijective Parameterization with Free Boundaries". It only steers; what is
// accepted is decided by the exact test of BoundaryGrid.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/types.h"
#include "flipfree/distortion/minimize/newton_system.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// The boundary of a chart in the plane: exact test whether the chart overlaps itself, and search
// for near pairs.

struct Boundary {
  std::vector<std::array<VertexId, 2>> edges;  // surface on the left
  std::vector<VertexId> vertices;
  std::vector<std::vector<VertexId>> loops;  // surface on the left
};
Boundary find_boundary(Index vertex_count, const Triangles& faces);

// Exact: do two boundary edges have a point in common other than a vertex that both end in?
bool edges_meet(const std::array<VertexId, 2>& e, const std::array<VertexId, 2>& f,
                const Points2& uv);

// Boundary edges by the square cells that they pass through; about as many cells as edges.
class BoundaryGrid {
 public:
  BoundaryGrid(const Boundary& boundary, const Points2& uv);

  // Exact: pairs of edges that have a point in common other than a shared vertex, not more than
  // `most`; a pair that meets in several cells comes several times.
  std::vector<std::array<Index, 2>> conflicts(std::size_t most,
                                              const ExecutionContext& context) const;

  // Edges with a point within `radius` of `point` (and perhaps some further ones), ascending.
  void near(const Vector2& point, double radius, std::vector<Index>& edges) const;

 private:
  static Index clamped(double cells, Index count);
  Index column(double x) const;
  Index row(double y) const;
  template <typename Visit>
  void for_cells(const Vector2& a, const Vector2& b, Visit visit) const;

  const Boundary& boundary_;
  const Points2& uv_;
  Vector2 low_;
  double cell_ = 1;
  Index columns_ = 1;
  Index rows_ = 1;
  Lists<Index> edges_;  // by cell
};

// Exact: the loops that run counter-clockwise, all but the outermost: holes and slits turned inside
// out. Precondition: no conflict.
std::vector<std::size_t> turned_loops(const Boundary& boundary, const Points2& uv);

// Exact: false if the chart is one-to-one. With flip-free triangles it is where no two boundary
// edges meet and no loop is turned; touching counts as meeting.
bool overlaps_itself(const Boundary& boundary, const Points2& uv, const ExecutionContext& context);
// The same of the faces' own boundary.
bool overlaps_itself(const Triangles& faces, const Points2& uv, const ExecutionContext& context);

class BoundaryBarrier {
 public:
  explicit BoundaryBarrier(const mesh::Surface& chart);

  const Boundary& boundary() const { return boundary_; }

  // How far the barrier reaches and what it weighs.
  struct Reach {
    double unit = 1;    // UV length of a surface length 1
    double factor = 1;  // times the ordinary reach; far reach lets parts give way before they meet
    double weight = 1;  // of each term
  };
  // Adds the terms at uv to an assembled system, and their values to the energy. False if the
  // system's pattern lacks a pair. Pairs that are nearer along the boundary than twice the far
  // reach cannot help being near: they have the ordinary reach always.
  bool add_to(NewtonSystem& system, const Points2& uv, const Reach& reach, double& energy) const;
  // Vertex pairs (lower first, sorted, unique) that contacts couple while no distance changes by
  // more than half of the reach, without those of contacts' own edges.
  std::vector<std::array<VertexId, 2>> couplings(const Points2& uv, const Reach& reach) const;
  // Sum of the values of the contacts.
  double value(const Points2& uv, const Reach& reach) const;

 private:
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
  template <typename Visit>
  void for_contacts(const Points2& uv, const Reach& reach, double wider, Visit visit) const;
  // Of a boundary vertex, and of the edge that leaves it.
  struct Station {
    double of_edge = 0;    // reach, in surface lengths
    double of_vertex = 0;  // the lesser of its two edges'
    double place = 0;      // along its loop, in surface lengths
    Index loop = kInvalid;
  };

  double along_boundary(const Station& vertex, const Station& edge) const;

  Boundary boundary_;
  std::vector<Station> stations_;
  std::vector<double> loop_length_;
};

}  // namespace flipfree::distortion
