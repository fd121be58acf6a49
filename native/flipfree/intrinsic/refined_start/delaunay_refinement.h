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

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"

namespace flipfree::intrinsic {
// A surface made of Euclidean triangles, given by edge lengths, and straight lines on it: every
// face has a plane of its own, and a line is continued by unfolding the next face.
//
// Lines are computed in double. What is decided with them (where a vertex is best added) is never
// a matter of validity.

// A place in one face, in the plane of that face.
struct FacePoint {
  FaceId face = kInvalid;
  Vector2 at = Vector2::Zero();
};

// A point to be added: inside a face, or on an edge.
struct AddedPoint {
  FacePoint place;
  HalfedgeId edge = kInvalid;  // of the surface, if the point lies on one
  double share = 0.0;          // of the way along `edge`
};

struct FlatFaces {
  // Half-edge 3 f + k runs from corner k to corner k + 1 of face f.
  struct Halfedge {
    VertexId origin = kInvalid;
    HalfedgeId opposite = kInvalid;  // kInvalid at the boundary
    double length = 0.0;
    double direction = 0.0;  // at its origin: angle, counter-clockwise from a fixed direction there
    Index piece = kInvalid;  // of the boundary that it is part of; the caller's
  };
  std::vector<Halfedge> half;  // 3 #F

  FaceId face_count() const { return static_cast<FaceId>(half.size() / 3); }
  double length(HalfedgeId h) const { return half[at(h)].length; }
  // The corners of a face in its plane: the first one at the origin, the second on the x axis.
  std::array<Vector2, 3> plane(FaceId f) const;
  Vector2 corner_at(CornerId c) const { return plane(c / 3)[at(c % 3)]; }
  double angle(CornerId c) const;
};

struct FlatSurface : FlatFaces {
  Index vertex_count = 0;
  Triangles faces;
  // Half-edges out of every vertex in counter-clockwise order, from the boundary on if there is
  // one; directions are counted from the first.
  std::vector<Index> fan_begin;  // #V + 1
  std::vector<HalfedgeId> fan;
  std::vector<double> total_angle;  // #V

  bool on_boundary(VertexId v) const {
    return half[at(fan[at(fan_begin[at(v)])])].opposite == kInvalid;
  }
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
