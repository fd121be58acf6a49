// Curves laid over a triangulation in normal position: straight inside every face, new vertices
// only where they cross edges.
//
// The faces at the beginning are the base faces. Curves cut each of them into cells; a curve that
// passes is an arc from edge to edge, from a corner to the facing edge, or runs along an edge. No
// arc has both ends on one edge, so arcs that do not cross are straight and disjoint wherever
// along their edges their ends lie, as long as their order there is right; cells are strictly
// convex and have at most six corners. Cells are kept triangulated; edges inside a cell
// (diagonals) carry no mark and change whenever an arc cuts it.
//
//        c                  Without cells, a path beside others has to cross the diagonals between
//       / \                 them as well and adds a vertex on each, which makes two more diagonals
//      p---q   arc          for the next: the number of vertices grows exponentially with the
//     / `.  \  diagonal     number of parallel paths. In normal position it is the number of
//    r-----`-s arc          crossings with the base's edges.
//   a---------b
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::mesh {

class CurveOverlay {
 public:
  // The faces' parents are the base's slots until finish(). `surface` must outlive this.
  explicit CurveOverlay(RefinedSurface& surface);

  // Does h run along an edge of the base (rather than through a face of it)?
  bool on_base_edge(HalfedgeId h) const;
  bool is_base_vertex(VertexId v) const { return v < base_vertices_; }
  // Continues a curve from vertex `here` through one cell to a new vertex on the base edge's piece
  // (a, b). Returns it, or kInvalid, with nothing changed, if no cell has both on its outline or
  // the piece is taken by a curve.
  VertexId cross(VertexId here, VertexId a, VertexId b, Index mark);
  // The same across the base edge from a to b, `along` which curves cross it in this order; where
  // places are too close together for rounding to tell, across one of the pieces beside.
  VertexId cross_at(VertexId here, VertexId a, VertexId b, double along, Index mark);
  // Continues a curve to an existing vertex, along an edge or through one cell. False, with nothing
  // changed, if that is not possible.
  bool reach(VertexId here, VertexId there, Index mark);
  // Spreads the new vertices evenly along their base edges and gives the faces their parents back.
  void finish();

 private:
  struct Cell {
    std::vector<FaceId> faces;
    std::vector<VertexId> outline;  // counter-clockwise, from the vertex it was asked for
  };
  Cell cell_at(HalfedgeId h) const;
  bool borders(HalfedgeId h) const;
  template <typename Test>
  HalfedgeId outgoing_with(VertexId v, const Test& test) const;
  bool is_on_cell(HalfedgeId h, VertexId v) const;
  void cut(const Cell& cell, VertexId there, Index mark);
  void spread_from(HalfedgeId h);

  RefinedSurface& surface_;
  EditableTriangulation& mesh_;
  std::vector<FaceId> parent_;  // per base slot
  Index base_vertices_;
  // By base edge where cross_at() has cut it, and the vertices there, in order.
  std::map<std::pair<VertexId, VertexId>, std::vector<std::pair<double, VertexId>>> cuts_;
};

}  // namespace flipfree::mesh
