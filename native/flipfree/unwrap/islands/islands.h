// What an unwrap is asked for; and from a surface and its seams to charts that can be flattened:
// planar pieces with at least one boundary loop.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// What automatic seams are asked for.

struct SeamOptions {
  bool find = false;  // seams are found where those given leave too much distortion
  // Lengths may change by this factor, about: every island keeps stretch_bound(). Above 1.
  double stretch = 1.25;
  // Edges as vertex pairs, and for each by how much a seam there costs more than its length: below
  // 1 is sought, above 1 avoided, infinite never taken.
  IndexPairs weighted;
  std::vector<double> weights;
  // Edges whose faces differ by more than this angle are seams; 0: none.
  double sharp_angle = 0.0;
  bool edges_only = false;  // maps are not wanted: seams found by the end of the time will do
};

// How much a map is stretched, or may be.
struct Stretch {
  double energy = 1.0;  // its mean, at the map's best scale
  // Of the triangles that a hundredth of the area is stretched more than: the factor by which their
  // lengths or areas change, up or down, whichever is most.
  double ratio = 1.0;

  bool within(const Stretch& most) const { return energy <= most.energy && ratio <= most.ratio; }
};

// The most that SeamOptions::stretch allows an island.
constexpr Stretch stretch_bound(double stretch) {
  return {0.5 * (stretch + 1.0 / stretch), 1.0 + 3.0 * (stretch - 1.0)};
}

// What an unwrap is asked for (unwrap.h).
struct UnwrapOptions {
  IndexPairs cuts;        // seam edges as vertex pairs
  IndexPairs uncuttable;  // edges that automatic cuts avoid: diagonals of polygons
  std::vector<certify::CornerPin>
      pins;  // met bit for bit; corners that share a vertex of a chart share the pin
  // #F, or empty: where more than two faces meet at an edge, those of one material rather go
  // together.
  std::vector<Index> material;
  // #F, or empty: triangles of one polygon, which stay in one piece (islands of their own if need
  // be). Where it is empty, `uncuttable` tells them.
  std::vector<Index> polygon;
  SeamOptions seams;      // beyond `cuts`; not with pins
  bool bijective = true;  // no chart overlaps itself
  // Charts that have to be cut open anyway are slit to their extremities too (extremities.h). Not
  // done if there are pins: both sides of a slit through a pinned vertex would share its place.
  bool cut_extremities = true;
  // With `bijective`, charts without pins that cannot be laid out without overlap at a distortion
  // near that of their free map are cut along further edges (separate.h) instead of crushed.
  bool may_add_cuts = true;
  bool acceptable = true;    // ExecutionContext::accept() ends the descents
  int max_iterations = 200;  // of the optimiser, per chart
  double tolerance = 1e-4;   // share of the energy that a step must still promise
  // Of the clock; 0: no limit. Charts that are flat by then are made no better.
  double max_seconds = 0;
  double margin = 0.005;  // between charts, in units of the unit square
  double effort = 0.2;    // of the search for a dense layout (packing/nest); 0: boxes
  // Former corner UVs (3 #F x 2) whose places are kept if that leaves a usable layout (place.h), or
  // null. Otherwise all charts without pins are packed, clear of those with pins.
  const Points2* place_like = nullptr;
};

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
