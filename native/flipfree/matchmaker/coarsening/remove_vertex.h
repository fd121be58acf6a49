// Removes an added vertex from a refined map: what fills its star then.
//
// Every new triangle is positive in the input face it lies in, by exact test; a star that lies on
// an edge of the input is retriangulated on both sides of that edge. In the map triangles are
// positive as well, or, for a caller that untangles afterwards, as far as may be.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/fill_polygon.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// The star of a vertex and what is to replace it.
struct StarFilling {
  std::vector<FaceId> star;
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  std::vector<FaceId> parents;  // per triangle
};

class VertexRemover {
 public:
  // The map must outlive it. Measures the map's energy: O(#F).
  explicit VertexRemover(mesh::RefinedMap& map);

  // Removes v if the map stays valid, also as stored, and no triangle becomes worse than the worst
  // removed or a few times the map's mean energy. Cost: O(valence^3).
  bool remove(VertexId v);

  // The triangulation that is best in the map, whether or not all of it is positive there. False
  // if the star is not where its support says, or has too many corners.
  bool fill(VertexId v, StarFilling& filling) { return fill(v, true, filling); }

 private:
  // One side of a star: corners counter-clockwise, closed by the edge from the last to the first.
  struct Side {
    std::vector<VertexId> corners;
    FaceId parent = kInvalid;
  };

  bool fill(VertexId v, bool turned_over, StarFilling& filling);
  bool split_star(VertexId v, std::vector<Side>& sides) const;
  bool triangulate(const Side& side, bool turned_over,
                   std::vector<mesh::EditableTriangulation::Triangle>& triangles);
  double angle(VertexId v) const;
  bool on_edge_of(VertexId v, VertexId w) const;
  double energy(VertexId a, VertexId b, VertexId c) const;
  std::array<double, 2> stretches(VertexId a, VertexId b, VertexId c) const;
  void measure();
  const mesh::Support& support(VertexId v) const { return map_.surface.support[at(v)]; }
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }

  mesh::RefinedMap& map_;
  mesh::EditableTriangulation& mesh_;
  double scale2_ = 1;  // square of the best global scale
  double mean_ = 0;    // energy of the map
  double bound_ = 0;   // of the new triangles of the star at hand
  mesh::PolygonFiller filler_;
};

// One pass over the vertices from `keep` on that are not held, the last added first: each goes
// where the map stays valid without it. Removed ones are compacted away; vertices below `keep` keep
// their ids. Returns the number removed.
Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context);

}  // namespace flipfree::matchmaker
