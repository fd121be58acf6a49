// Whole turns: does a triangulation of a face's image wind around its corners as often as the map
// does?
//
// A cone of more than 2 pi may lie at a face whose corner angle is itself larger than pi or even 2
// pi. Then the three corners alone can form a positive triangle that is nevertheless not the face's
// image: its angles differ from the developed ones by full turns. The developed angle at a corner
// is known from the layout; for a subset of the points on the sides it changes by the winding of
// the skipped part of the side around the corner.
#pragma once

#include <array>
#include <vector>

#include "flipfree/intrinsic/layout/polygon/polygon_triangulation.h"
#include "flipfree/intrinsic/layout/refine/edge_point_map.h"

namespace flipfree::intrinsic {

// The angles that the vertices of a polygon have in the development. `polygon`: corners and some
// points of face f in counter-clockwise order, corner 0 first; ids are vertices of the input below
// `vertex_count`, else vertex_count + point. Cost: O(points of the face's sides).
std::vector<double> developed_angles(const EdgePointMap& map, Index vertex_count, FaceId f,
                                     const std::vector<PolygonVertex>& polygon);

// True if at every vertex of the polygon the angles of the triangles (given by ids) sum to the
// developed one, up to less than a turn.
bool angles_are_developed(const std::vector<double>& developed,
                          const std::vector<PolygonVertex>& polygon,
                          const std::vector<std::array<Index, 3>>& triangles);

}  // namespace flipfree::intrinsic
