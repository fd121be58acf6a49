// Demands that contradict each other, each with a proof that others can check (docs/errors.md).
#pragma once

#include <string>
#include <vector>

#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// A vertex, as messages name it.
std::string vertex_name(VertexId v);

// Fills in turning_number and simple_outline. Throws Infeasible where no map meets `constraints`:
// an outline that runs clockwise or winds wrongly, two vertices at one point, lines that cross, a
// pin or a line that leaves the outline; NotConverged where one that overlaps itself might do it,
// which is allowed but not looked for. Precondition: targets are finite. Cost: quadratic in the
// lines' edges.
void refuse_contradictions(const mesh::RefinedSurface& surface, SelfOverlaps overlaps,
                           Constraints& constraints);

// Infeasible if a closed chain of edges runs the other way round in the map than on the mesh.
// Precondition: its first vertex is its last, and so many targets at least.
void refuse_reversed_line(const mesh::EditableTriangulation& mesh,
                          const std::vector<VertexId>& chain, const Polygon& polyline);

}  // namespace flipfree::matchmaker
