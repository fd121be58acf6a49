// Intrinsic Delaunay refinement: which flat points to add to a surface so that the intrinsic
// Delaunay triangulation of all its vertices has no small angles (the cure of thesis 4.6.4).
//
// Chew 1993 and Ruppert 1995 on a polyhedral surface, after Sharp, Soliman, Crane 2019,
// "Navigating intrinsic triangulations": circumcentres of bad triangles are added, largest first,
// and midpoints of boundary edges whose diametral circle holds a vertex. An intrinsic
// triangulation with signposts (the direction of every edge at its origin) follows the insertions;
// it finds every new point on the input by a straight line from the nearest vertex. It is computed
// in double and thrown away afterwards: what counts are the places on the input, and any places
// give a valid refined surface (split_surface.h).
//
// A point closer to an edge of the input than kSnap of its distance to the vertices is put on it,
// so that no face of the refined surface is thinner than it must be. Triangles at a vertex with a
// total angle below 60 degrees (30 degrees at each of two edges) are left as they are: no
// refinement can help there.
#pragma once

#include <cmath>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {
// A surface made of Euclidean triangles, given by edge lengths, and straight lines on it: every
// face is laid out in a plane of its own, and a line is continued by unfolding the next face.
//
// Lines are computed in double. What is decided with them (where a vertex is best added) is never
// a matter of validity.

inline Vector2 rotated(const Vector2& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

// The corner opposite an edge of length c along the x axis, seen from the edge's first end: `b` is
// the side at that end, `a` the one at the other. By Heron's formula in Kahan's form, so that
// needles keep their height.
Vector2 apex_of(double c, double a, double b);

// A place in one face, in the plane of that face.
struct FacePoint {
  FaceId face = kInvalid;
  Vector2 at = Vector2::Zero();
};
struct FaceRay : FacePoint {
  Vector2 direction = Vector2::UnitX();  // of length 1
};

// A point to be added: inside a face, or on an edge.
struct AddedPoint {
  FacePoint place;
  HalfedgeId edge = kInvalid;  // of the surface, if the point lies on one
  double share = 0.0;          // of the way along `edge`
};

struct FlatSurface {
  Index vertex_count = 0;
  Triangles faces;
  mesh::Adjacency adjacency;
  std::vector<double> length;  // 3 #F, per half-edge
  Points2 corner;              // 3 #F x 2: corner 0 at the origin, corner 1 on the x axis
  std::vector<double> angle;   // 3 #F: of the corner
  // Half-edges out of every vertex in counter-clockwise order, from adjacency.vertex_halfedge on,
  // and the sum of the angles before each.
  std::vector<Index> fan_begin;  // #V + 1
  std::vector<HalfedgeId> fan;
  std::vector<double> fan_start;
  std::vector<double> total_angle;  // #V

  bool on_boundary(VertexId v) const;
  Vector2 corner_at(CornerId c) const { return corner.row(c); }
  // Weights of a face's corners at a place in its plane.
  Vector3 weights(const FacePoint& p) const;
};

// `lengths`: #F x 3, corner k to k + 1; strict triangle inequality in every face.
FlatSurface make_flat_surface(Index vertex_count, const Triangles& faces, const Points3& lengths);
// Lengths between vertex positions.
Points3 lengths_of(const Points3& vertices, const Triangles& faces);

struct RefinementOptions {
  // Triangles with a smaller angle are bad (radians). Above 20.7 degrees on surfaces with boundary
  // and 30 on closed ones, termination is no theorem, and the number of points is what ends it.
  double least_angle = 0.35;
  Index max_added = 1'000'000;
};

struct RefinementPoints {
  std::vector<AddedPoint> points;  // in the order of insertion
  double smallest_angle = 0.0;     // of the input's intrinsic Delaunay triangulation (away from
                                   // needle vertices), radians
  bool complete = false;           // no bad triangle is left
};

// Deterministic. Cost: O(#F + points) flips and steps, each O(1) on ordinary surfaces.
RefinementPoints find_refinement_points(const FlatSurface& surface,
                                        const RefinementOptions& options,
                                        const ExecutionContext& context);

}  // namespace flipfree::intrinsic
