// An intrinsic triangulation of a FlatSurface that is flipped to Delaunay and grows by inserted
// points; every half-edge knows its direction at its origin (signposts: Sharp, Soliman, Crane
// 2019), so that every inserted point is found on the input by one straight line.
//
//            k                 h = i -> j, inner half-edges in orbits of `next` of length 3; the
//          /   \               outer half-edge of a boundary edge has next = kInvalid.
//        i --h-- j             Edge e owns half-edges 2 e and 2 e + 1.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/refined_start/flat_surface.h"

namespace flipfree::intrinsic {

class SignpostTriangulation {
 public:
  explicit SignpostTriangulation(const FlatSurface& surface);

  struct Vertex {
    double total_angle = 0.0;
    bool boundary = false;
    AddedPoint point;  // of vertices added
  };
  // A place in a face of this triangulation: in the plane where half-edge h starts at the origin
  // and runs along the x axis.
  struct Place {
    HalfedgeId h = kInvalid;
    Vector2 at = Vector2::Zero();
    HalfedgeId crossed_boundary = kInvalid;  // the line ended at this boundary edge instead
  };

  Index face_count() const { return static_cast<Index>(face_halfedge_.size()); }
  HalfedgeId face_halfedge(FaceId f) const { return face_halfedge_[at(f)]; }
  FaceId face(HalfedgeId h) const { return face_[at(h)]; }
  HalfedgeId next(HalfedgeId h) const { return next_[at(h)]; }
  VertexId origin(HalfedgeId h) const { return origin_[at(h)]; }
  double length(HalfedgeId h) const { return length_[at(h >> 1)]; }
  bool inside(HalfedgeId h) const { return next_[at(h)] != kInvalid; }
  bool on_boundary(HalfedgeId h) const { return !inside(h) || !inside(h ^ 1); }
  const Vertex& vertex(VertexId v) const { return vertices_[at(v)]; }
  const std::vector<Vertex>& vertices() const { return vertices_; }
  Index edge_count() const { return static_cast<Index>(length_.size()); }

  // Flips until the edges queued (all at the beginning, then those around insertions) and what
  // they drag along are Delaunay. Faces changed since the last call of take_changed() are noted.
  void restore_delaunay(const ExecutionContext& context);
  std::vector<FaceId> take_changed();

  // Apex of h's face in the plane of Place.
  Vector2 apex(HalfedgeId h) const;
  // Walks from inside h's face straight to a place given in its plane.
  Place locate(HalfedgeId h, const Vector2& target) const;
  // Boundary edges whose diametral circle a vertex at this place would enter.
  void encroached_by(const Place& place, std::vector<HalfedgeId>& edges);

  // Inserts a vertex at a place inside a face: traced on the input, and put on an input edge that
  // is very near. False, and nothing changes, if the line could not be followed.
  bool insert(Place place);
  // Splits a boundary edge, h its inner half-edge, at its midpoint.
  void split_boundary(HalfedgeId h);

 private:
  using Plane = std::array<Vector2, 3>;  // corners of a face in the plane of Place
  // A place on the input, and the rotation from the plane of the triangle to that of the input's
  // face as a complex number.
  struct Found {
    AddedPoint point;
    Vector2 to_input = Vector2::UnitX();
    double distance = 0.0;  // from the nearest vertex
  };
  Plane plane_of(HalfedgeId h) const;
  bool trace(const Place& place, Found& found) const;
  // Moves both onto an input edge if one is very near.
  bool snap(Place& place, Found& found) const;
  HalfedgeId previous(HalfedgeId h) const { return next_[at(next_[at(h)])]; }
  double angle(HalfedgeId h) const;
  bool violates_delaunay(EdgeId e) const;
  void flip(EdgeId e);
  void queue(HalfedgeId h);
  void touch(FaceId f);
  HalfedgeId add_edge(VertexId from, VertexId to, double length);
  void set_face(FaceId f, HalfedgeId a, HalfedgeId b, HalfedgeId c);
  FaceId add_face();
  FaceRay ray(VertexId v, double direction) const;

  const FlatSurface& surface_;
  std::vector<HalfedgeId> next_;   // #H
  std::vector<VertexId> origin_;   // #H
  std::vector<FaceId> face_;       // #H
  std::vector<double> direction_;  // #H, at the origin
  std::vector<double> length_;     // #E
  std::vector<HalfedgeId> face_halfedge_;
  std::vector<Vertex> vertices_;
  // Boundary edges: where they run on the input's boundary.
  struct BoundaryPiece {
    HalfedgeId edge = kInvalid;
    double from = 0.0, to = 1.0;
  };
  std::vector<BoundaryPiece> piece_;  // #E
  std::vector<EdgeId> stack_;
  std::vector<char> queued_;  // #E
  std::vector<FaceId> changed_;
  std::vector<char> is_changed_;  // #F
  // Scratch of encroached_by.
  struct Visit {
    HalfedgeId h;
    Vector2 a, b;
  };
  std::vector<Visit> visits_;
};

}  // namespace flipfree::intrinsic
