// The map by the whole numbers that were chosen for its coarse surface: affine on each of the
// coarse triangles, so that no triangle flips once their edges are drawn on the map.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/quads/coarse.h"

namespace flipfree::quads {

class Developed {
 public:
  // `coarse`: of `map`, with its integers. Cost: the coarse triangles that the map's edges cross.
  Developed(const FlatSurface& map, const CoarseSurface& coarse, const ExecutionContext& context);

  // Per half-edge of the map, in the chart of its face: from one end to the other.
  const std::vector<Vector2>& edges() const { return moved_; }

  // Where the half-edge's source lies from a point of whole numbers, in the half-edge's chart.
  Vector2 from_whole(HalfedgeId h) const;

  // The map with a point wherever one of its edges crosses a coarse one. `corner_uv`: 3 #F x 2, by
  // edges(); `adjacency`: of the map's triangles.
  intrinsic::EdgePointMap points(const Points2& corner_uv, const mesh::Adjacency& adjacency) const;

 private:
  // How a half-edge of the map leaves its vertex: the vertex's place on the coarse surface, in its
  // old integers; and by how many quarters vectors in the half-edge's chart turn to be ones there.
  struct Departure {
    Place place;
    Index turn = 0;
  };
  // Where a half-edge crosses a coarse edge: share of its length, and from its source.
  struct Bend {
    double along;
    Vector2 place;
  };

  bool is_known(HalfedgeId h) const { return from_[at(h)].place.face != kInvalid; }
  void set(HalfedgeId h, Place place, Index turn);
  void depart_from_corner(HalfedgeId e);
  Vector2 image(const Place& place) const;
  void cross(HalfedgeId h);
  void spread(HalfedgeId first, const Place& place, Index turn);
  Vector2 first_piece(HalfedgeId h) const;
  Vector2 last_piece(HalfedgeId h) const;

  const FlatSurface& map_;
  const CoarseSurface& coarse_;
  std::vector<Departure> from_;
  std::vector<Vector2> moved_;
  std::vector<std::vector<Bend>> bends_;
  std::vector<HalfedgeId> queue_;
};

}  // namespace flipfree::quads
