// Phase 1 of MatchMaker++ (thesis 3.3): the target domain as a triangulated disk, merged into
// convex polygons.
//
// The disk is abstract: several of its vertices may share a point of the plane where an immersed
// target overlaps itself. Every vertex stands for one mesh vertex. Half-edges of the triangulation
// carry marks: kUnmarked for edges that can be dropped, kFixedEdge for those that the outline or a
// slit prescribes, 1 + i for the prescribed path number i.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request.h"

namespace flipfree::matchmaker {

struct TargetDomain {
  static constexpr Index kFixedEdge = 0;

  mesh::EditableTriangulation triangulation;
  std::vector<Vector2> point;         // per domain vertex
  std::vector<VertexId> mesh_vertex;  // per domain vertex
  std::vector<Index> outline;         // domain vertices along the boundary, domain on the left

  const Vector2& at(Index v) const { return point[static_cast<std::size_t>(v)]; }
  VertexId vertex_of(Index v) const { return mesh_vertex[static_cast<std::size_t>(v)]; }
  // Marks the edge of two vertices. Throws InternalError if there is none.
  void fix(Index a, Index b, Index mark = kFixedEdge);
  // Where the outline's vertices lie.
  Polygon outline_points() const;
};

// An embedded target: a simple counter-clockwise outline, points strictly inside, fixed edges
// between vertices (numbered: outline first, then points). The constrained Delaunay triangulation
// of it. Preconditions: all points different, fixed edges meet at vertices only (checked by the
// caller, who can name them).
TargetDomain triangulate_embedded(const Polygon& outline, std::span<const Vector2> inner,
                                  std::span<const std::pair<Index, Index>> fixed_edges);

// The triangles (sheets) whose closure contains the point; a point on an edge or a vertex of the
// triangulation counts once, by the lowest of the faces around it.
std::vector<FaceId> sheets_at(const TargetDomain& domain, const Vector2& point);

// Flips unmarked edges until all of them are locally Delaunay.
void make_delaunay(TargetDomain& domain);

// The convex polygons that remain when unmarked edges are dropped greedily, longest first, wherever
// the polygon stays convex (Hertel and Mehlhorn 1983). Straight corners are allowed; every polygon
// has at least three strict ones.
struct ConvexPartition {
  struct Edge {
    Index a, b;     // domain vertices
    bool boundary;  // runs along the outline, the domain on the left of a -> b
    Index given;    // number of the prescribed path that it is, or kInvalid
  };
  struct Side {
    Index edge;
    bool forward;  // the polygon lies on the left of a -> b
  };
  std::vector<Edge> edges;
  std::vector<std::vector<Side>> polygons;  // counter-clockwise
  // Per domain vertex its edges counter-clockwise; at an outline vertex from the edge that leaves
  // it along the outline to the one that arrives.
  std::vector<std::vector<Index>> around;
};
ConvexPartition merge_convex(const TargetDomain& domain);

// Phase 2 of MatchMaker++ (thesis 3.3): the convex partition of the target drawn on the surface.
//
// Every edge of the partition becomes a path of mesh edges between the mesh vertices of its ends;
// paths meet at their ends only, leave each vertex in the target's cyclic order, and so cut the
// surface into patches that correspond to the polygons. Order (Praun, Sweldens, Schroeder 2001):
// first a spanning tree grown from the boundary, whose paths can never close a loop around a point:
// of all edges that join one more point, always that with the shortest path as the others lie. How
// often paths wind around each other is decided here, hence by how much the surface is refined.
// Then the rest, each of which divides one patch in two. Where no path runs along
// existing free edges, it crosses edges, which are split there (Steiner points; Kraevoy, Sheffer,
// Gotsman 2003), those of the surface only (curve_overlay.h). Paths are shortest on the surface.
//
// Termination: every edge of the partition is traced once. A path always exists: the sectors at its
// two ends belong to the same connected piece of the cut surface, faces are joined across edges
// that carry no path, and a path may cross any of these.

// Paths by partition edge, each from the mesh vertex of `a` to that of `b`, both included.
using Paths = std::vector<std::vector<VertexId>>;

// `given`: the prescribed paths, along existing mesh edges. Outline edges
// follow the mesh boundary. Marks of mesh edges become the partition edge that runs along them.
// Throws InvalidInput (kBadPins) if given paths contradict each other, NotConverged if paths wind
// beyond all measure, InternalError if the preconditions (matching orders on the boundary) do not
// hold.
Paths trace_paths(mesh::RefinedSurface& surface, const TargetDomain& domain,
                  const ConvexPartition& partition, const std::vector<std::vector<VertexId>>& given,
                  ExecutionContext& context);

// Carries a map along when the triangulated polygon under it changes shape.

// Does the triangle's closure, at shape `place` (a point per domain vertex), hold the point?
bool holds(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
           const Vector2& p);
// The triangle of the domain that holds b at shape `place`, found along the segment a -> b from
// face f, which holds a, or, if `corner` is given, from that domain vertex, which lies at a.
// kInvalid if the segment leaves the domain. Cost: O(triangles crossed).
FaceId find_along(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
                  Index corner, const Vector2& a, const Vector2& b);

// The vertices of a map, each in a triangle of the domain, on which it rides when the domain
// changes shape. The domain may overlap itself: triangles are found along mesh edges, starting from
// the boundary, which stay within the disk. What is carried is a guess for where a map goes,
// without guarantee: long edges may cross after it.
class Carrier {
 public:
  // Preconditions: uv is flip-free, its boundary vertices are at `here`, a shape of the domain (a
  // point per domain vertex) without folds. All must outlive it. Cost: O(#E +
  // domain edges crossed by a spanning tree of mesh edges).
  Carrier(const mesh::RefinedSurface& surface, const Points2& uv, const TargetDomain& domain,
          const std::vector<Vector2>& here, const ExecutionContext& context);

  // All vertices when the domain has shape `there`.
  Points2 vertices(const std::vector<Vector2>& there) const;

 private:
  const Points2& uv_;
  const TargetDomain& domain_;
  const std::vector<Vector2>& here_;
  std::vector<FaceId> face_;   // per vertex; kInvalid if not found: it stays where it is
  std::vector<Index> corner_;  // per vertex the domain vertex it is, if any
};

}  // namespace flipfree::matchmaker
