// The surface on which the curves of a cut are drawn, refined as they come (thesis 5.4.1).
//
// Curves run along edges. A vertex is free if it is neither a cone nor on a curve. After every
// curve each edge that is not on one and joins two vertices that are not free is split, so that
// whatever the curves leave connected is connected through free vertices: faces that meet in an
// edge share its free end, and the free vertices of a face are joined by its edges.
//
// A sector is what lies between two curves around a vertex, named by the half-edge of the first of
// them in counter-clockwise order: it leaves the vertex and has the sector on its left. A point
// inside a curve has two sectors, one per side.
#pragma once

#include <vector>

#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {

// What an edge is part of.
enum class Curve : Index {
  kNone = mesh::EditableTriangulation::kUnmarked,
  kLoop,
  kConnector,
  kExtra,
  kFence
};

// Steps of a search through free vertices between two looks at whether it was cancelled.
inline constexpr int kFreeStepsPerCheck = 4096;

class Canvas {
 public:
  // `surface`: closed, connected, in a unit in which squares of lengths neither overflow nor
  // vanish; must outlive this. `cones`: #V, quarter turns.
  Canvas(const mesh::Surface& surface, const std::vector<Index>& cones);

  const mesh::EditableTriangulation& mesh() const { return refined_.mesh; }
  Index vertex_count() const { return refined_.mesh.vertex_count(); }
  double length(HalfedgeId h) const;
  // k - 4: what a cone adds to the corners around it; 0 where it is flat.
  Index excess(VertexId v) const {
    return v < static_cast<VertexId>(cones_.size()) ? cones_[at(v)] - kFlat : 0;
  }
  bool is_free(VertexId v) const { return state_[at(v)] == State::kFree; }
  bool on_curve(VertexId v) const { return state_[at(v)] == State::kOnCurve; }
  Curve curve(HalfedgeId h) const { return static_cast<Curve>(refined_.mesh.mark(h)); }
  bool is_drawn(HalfedgeId h) const { return curve(h) != Curve::kNone; }

  // The sector of h, which leaves a vertex on a curve and is not drawn itself (or names one).
  HalfedgeId sector_of(HalfedgeId h) const;
  // Calls visit(h) for the half-edges strictly inside a sector, counter-clockwise.
  template <typename Visit>
  void for_each_inside(HalfedgeId sector, const Visit& visit) const {
    for (HalfedgeId h = mesh().rotate_ccw(sector); !is_drawn(h); h = mesh().rotate_ccw(h)) visit(h);
  }
  // Drawn half-edges around v, counter-clockwise.
  std::vector<HalfedgeId> drawn_around(VertexId v) const;
  // The half-edges of a cycle of vertices, in order.
  std::vector<HalfedgeId> edges_of(const std::vector<VertexId>& cycle) const;

  // Draws edges and refines. `path`: half-edges in any order; none drawn yet.
  void draw(const std::vector<HalfedgeId>& path, Curve kind);
  // Undraws edges; vertices that no drawn edge is left at are free again. The refinement stays.
  void erase(const std::vector<HalfedgeId>& path);
  // Undraws all. The refinement stays.
  void erase_all();
  // Splits edges of a chain of drawn half-edges until it has `edges`; returns its vertices.
  std::vector<VertexId> divide(const std::vector<HalfedgeId>& chain, std::size_t edges);
  // Puts a free vertex on an edge that is not drawn.
  VertexId halve(HalfedgeId h);
  // Undraws every fence. The refinement stays.
  void remove_fences();

  // The half-edge 3 f + k of the input's face f across which h leaves it; kInvalid if h and its
  // opposite lie in the same one.
  HalfedgeId input_side(HalfedgeId h) const;

  // The surface as it is now, half-edges 3 f + k the same.
  mesh::Surface surface() const;
  mesh::Provenance provenance() const;

 private:
  enum class State : char { kFree, kCone, kOnCurve, kFenced };
  VertexId split(HalfedgeId h);
  void refine_around(VertexId v);

  mesh::RefinedSurface refined_;
  std::vector<Index> cones_;  // of the input's vertices
  std::vector<State> state_;  // #V
};

}  // namespace flipfree::seamless
