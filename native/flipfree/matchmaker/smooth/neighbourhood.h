// The part of a refined map around some of its vertices, as a mesh of its own: for solvers that
// need not look at the rest.
#pragma once

#include <vector>

#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// All of these cost O(k log k) for k faces of the neighbourhood, whatever the size of the map.

// The vertices within so many edges of the seeds, these included; ascending. Seeds may repeat.
std::vector<VertexId> vertices_near(const mesh::EditableTriangulation& mesh,
                                    std::vector<VertexId> seeds, int rings);
// The faces with one of the vertices as a corner; ascending.
std::vector<FaceId> faces_at(const mesh::EditableTriangulation& mesh,
                             const std::vector<VertexId>& vertices);
// The same for added vertices: the corners of the faces that they are corners of.
std::vector<VertexId> around_added(const mesh::EditableTriangulation& mesh, Index keep);

// Some triangles of a map, or triangles that are to be some of it, with numbers of their own.
struct Patch {
  std::vector<VertexId> vertices;  // of the map, ascending; their places are the patch's vertices
  mesh::Surface surface;
  Points2 uv;
};
Patch make_patch(const mesh::RefinedMap& map,
                 const std::vector<mesh::EditableTriangulation::Triangle>& triangles);

// Would an inner vertex wind more often than once with these faces, of vertices of the patch
// (ascending) mapped by `uv`, in place of the faces `replaced`? Positive triangles can wind twice;
// angles that differ by 2 pi are told apart beyond rounding. Precondition: no vertex does now.
bool winds_more(const mesh::RefinedMap& map, const std::vector<VertexId>& vertices,
                const Triangles& faces, const Points2& uv, const std::vector<FaceId>& replaced);

}  // namespace flipfree::matchmaker
