// A surface made of Euclidean triangles, given by edge lengths, and straight lines on it: every
// face is laid out in a plane of its own, and a line is continued by unfolding the next face.
//
// Lines are computed in double. What is decided with them (where a vertex is best added) is never
// a matter of validity.
#pragma once

#include <cmath>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {

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

// A ray that leaves vertex v at `direction` radians, counter-clockwise from the first half-edge of
// its fan; taken modulo the total angle at vertices inside.
FaceRay ray_from_vertex(const FlatSurface& surface, VertexId v, double direction);
// Follows the ray for `distance`. Ends early at the boundary, or after a number of faces that no
// sensible line crosses: false then.
bool follow_ray(const FlatSurface& surface, FaceRay& ray, double distance);

}  // namespace flipfree::intrinsic
