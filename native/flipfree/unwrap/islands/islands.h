// From a surface and its seams to charts that can be flattened: planar pieces with at least one
// boundary loop.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

struct Islands {
  mesh::EdgeFlags cut;              // seams plus the cuts that were added
  mesh::EdgeFlags added;            // only the cuts that were added
  mesh::CutMesh mesh;               // the surface cut along `cut`
  std::vector<mesh::Chart> charts;  // chart.vertices index mesh.vertex_origin
  Index opened = 0;                 // charts that had to be cut: closed, or with handles
};

// How pieces are opened.
struct Opening {
  std::vector<char> pinned;  // per vertex, or empty: passed through only where nothing else is left
  std::vector<double> cost;  // per half-edge, or empty: of cuts, instead of lengths
  bool spheres = true;       // false: closed pieces of genus 0 stay closed
};

// Cuts along the seams; every piece that is closed or has handles is cut further along a short cut
// graph (mesh/cut_graph.h) until each chart is connected, of genus 0 and has a boundary. Holes
// stay. A seam that opens nothing (a single edge inside a chart) is not a cut of the result.
// With `extremities`, charts that had to be opened are also slit to theirs (extremities.h); pieces
// whose seams were enough never are.
// Added cuts avoid the flagged edges of `uncuttable` (may be empty); see planar_cut.
// Precondition: a validated surface. Cost: O(#F log #F), and a sparse
// factorization or two with `extremities`.
Islands make_islands(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                     const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
                     bool extremities, ExecutionContext& context, const Opening& opening = {});

// Cuts the islands along further edges of the surface, which count as added, and numbers the charts
// anew.
void cut_further(Islands& islands, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                 const mesh::EdgeFlags& further);

// Positions scaled by one power of two, which is exact, so that squares neither overflow nor vanish
// whatever the user's unit is; every component is moved to the origin on its own, so that none of
// them is lost beside one that is large or far away.
// Cost: O(#V + #F).
Points3 normalised(const Points3& positions, const Triangles& faces);

}  // namespace flipfree::unwrap
