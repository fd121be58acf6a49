// What an unwrap is asked for; and from a surface and its seams to charts that can be flattened:
// planar pieces with at least one boundary loop.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/mesh/adjacency.h"
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

// How charts are laid flat.
struct DescentOptions {
  bool bijective = true;     // no chart overlaps itself
  bool acceptable = true;    // ExecutionContext::accept() ends the descents
  int max_iterations = 200;  // of the optimiser, per chart
  double tolerance = 1e-4;   // share of the energy that a step must still promise
};

// What an unwrap is asked for (unwrap.h).
struct UnwrapOptions : DescentOptions {
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
  SeamOptions seams;  // beyond `cuts`; not with pins
  // Charts that have to be cut open anyway are slit to their extremities too. Not
  // done if there are pins: both sides of a slit through a pinned vertex would share its place.
  bool cut_extremities = true;
  // With `bijective`, charts without pins that cannot be laid out without overlap at a distortion
  // near that of their free map are cut along further edges (separate.h) instead of crushed.
  bool may_add_cuts = true;
  // Of the clock; 0: no limit. Charts that are flat by then are made no better.
  double max_seconds = 0;
  double margin = 0.005;  // between charts, in units of the unit square
  double effort = 0.2;    // of the search for a dense layout (packing/nest); 0: boxes
  // Former corner UVs (3 #F x 2) whose places are kept if that leaves a usable layout (place.h).
  // Otherwise all charts without pins are packed, clear of those with pins.
  std::optional<Points2> place_like;
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
  // Per vertex, or empty: passed through only where nothing else is left.
  std::vector<char> pinned = {};
  std::vector<double> cost = {};  // per half-edge, or empty: of cuts, instead of lengths
  bool spheres = true;            // false: closed pieces of genus 0 stay closed
};

// Cuts along the seams; every piece that is closed or has handles is cut further along a short cut
// graph (mesh/cut_graph.h) until each chart is connected, of genus 0 and has a boundary. Holes
// stay. A seam that opens nothing (a single edge inside a chart) is not a cut of the result.
// Added cuts avoid the flagged edges of `uncuttable` (may be empty); see planar_cut.
// Precondition: a validated surface. Cost: O(#F log #F).
Islands make_islands(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                     const mesh::EdgeFlags& uncuttable, ExecutionContext& context,
                     const Opening& opening = {});

// Cuts the islands along further edges of the surface, which count as added, and numbers the charts
// anew.
void cut_further(Islands& islands, const mesh::Surface& surface, const mesh::EdgeFlags& further);

// Positions scaled by one power of two, which is exact, so that squares neither overflow nor vanish
// whatever the user's unit is; every component is moved to the origin on its own, so that none of
// them is lost beside one that is large or far away.
// Cost: O(#V + #F).
Points3 normalised(const Points3& positions, const Triangles& faces);

// Flags of the edges given as vertex pairs; empty without any.
inline mesh::EdgeFlags flags_of(const mesh::Surface& surface, const IndexPairs& edges) {
  return edges.rows() == 0 ? mesh::EdgeFlags{}
                           : mesh::flag_edges(surface.faces, surface.adjacency(), edges);
}

// Values by corner of a surface, by vertex of its charts.

// The corner, or half-edge, of the surface that is the chart's corner h.
inline std::size_t corner_of(const mesh::Chart& chart, std::size_t h) {
  return 3 * at(chart.faces[h / 3]) + h % 3;
}

inline std::size_t corner_count(const mesh::Chart& chart) { return 3 * chart.faces.size(); }

// Of values per corner of the surface (none: none) those of the chart.
template <typename Value>
std::vector<Value> part_of(const mesh::Chart& chart, const std::vector<Value>& corners) {
  std::vector<Value> own;
  for (std::size_t h = 0; h < corner_count(chart) && !corners.empty(); ++h)
    own.push_back(corners[corner_of(chart, h)]);
  return own;
}

// The chart's values per corner (none: none) as a part of those of the surface.
template <typename Value>
void put_part(const mesh::Chart& chart, const std::vector<Value>& own,
              std::vector<Value>& corners) {
  for (std::size_t h = 0; h < own.size(); ++h) corners[corner_of(chart, h)] = own[h];
}

// The map of a surface (3 #F x 2) by vertex (#V x 2), and of one of its charts.
inline Points2 by_vertex(const mesh::Surface& surface, const Points2& corners) {
  Points2 uv(surface.vertices.rows(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) uv.row(surface.faces.data()[c]) = corners.row(c);
  return uv;
}
inline Points2 by_vertex(const mesh::Chart& chart, const Points2& corners) {
  Points2 uv(chart.surface.vertices.rows(), 2);
  for (std::size_t h = 0; h < corner_count(chart); ++h)
    uv.row(chart.surface.faces.data()[h]) =
        corners.row(static_cast<Eigen::Index>(corner_of(chart, h)));
  return uv;
}
// The chart's map (#V x 2) as a part of that of the surface (3 #F x 2).
template <typename Points>
void put_corners(const mesh::Chart& chart, const Points& uv, Points& corners) {
  for (std::size_t h = 0; h < corner_count(chart); ++h)
    corners.row(static_cast<Eigen::Index>(corner_of(chart, h))) =
        uv.row(chart.surface.faces.data()[h]);
}

inline double edge_length(const mesh::Surface& surface, HalfedgeId h) {
  return (surface.vertices.row(mesh::source(surface.faces, h)) -
          surface.vertices.row(mesh::target(surface.faces, h)))
      .norm();
}

inline double face_area(const mesh::Surface& surface, FaceId f) {
  return 0.5 * surface.area_vector(f).norm();
}
std::vector<double> face_areas(const mesh::Surface& surface);

// Between the normals of two faces, radians.
inline double bend_between(const mesh::Surface& surface, FaceId f, FaceId g) {
  const Vector3 n = surface.area_vector(f);
  const Vector3 m = surface.area_vector(g);
  return std::atan2(n.cross(m).norm(), n.dot(m));
}

inline double uv_area(const Triangles& faces, const Points2& uv, FaceId f) {
  return 0.5 * twice_area(uv.row(faces(f, 0)), uv.row(faces(f, 1)), uv.row(faces(f, 2)));
}

// Of the whole map.
inline double uv_area(const Triangles& faces, const Points2& uv) {
  double area = 0.0;
  for (FaceId f = 0; f < faces.rows(); ++f) area += uv_area(faces, uv, f);
  return area;
}

// The first of the longest loops of half-edges; 0 if there is none.
inline std::size_t longest_loop(const mesh::Surface& surface,
                                const std::vector<std::vector<HalfedgeId>>& loops) {
  std::vector<double> length;
  for (const auto& loop : loops) {
    length.push_back(0.0);
    for (const HalfedgeId h : loop) length.back() += edge_length(surface, h);
  }
  return at(std::max_element(length.begin(), length.end()) - length.begin());
}

// The least value of (value, weight) pairs with this share of the weights at or below it; 0 of
// nothing.
double weighted_percentile(std::vector<std::pair<double, double>> weighted, double share = 0.5);

using distortion::overlaps_itself;

// The charts, or those chosen (flags), those of most faces first.
inline std::vector<std::size_t> largest_first(const std::vector<mesh::Chart>& charts,
                                              const std::vector<char>& chosen = {}) {
  std::vector<std::size_t> order;
  for (std::size_t c = 0; c < charts.size(); ++c)
    if (chosen.empty() || chosen[c] != 0) order.push_back(c);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].faces.size() > charts[b].faces.size();
  });
  return order;
}

// Calls solve(chart, context) for all in `order` (largest_first()). One that holds half of all
// faces gets all threads; the others share them, one chart each.
template <typename Solve>
void for_each_chart(const std::vector<mesh::Chart>& charts, const std::vector<std::size_t>& order,
                    const char* stage, ExecutionContext& context, Solve solve) {
  double total = 0.0;
  for (const std::size_t c : order) total += static_cast<double>(charts[c].faces.size());
  const auto share_of = [&](std::size_t c) {
    return static_cast<double>(charts[c].faces.size()) / total;
  };
  std::size_t alone = 0;
  double done = 0.0;
  if (!order.empty() && share_of(order[0]) >= 0.5) {
    done = share_of(order[0]);
    const ProgressRange range(context, 0.0, done);
    solve(order[0], context);
    alone = 1;
  }
  SharedProgress progress(context, done);
  parallel_for(context, order.size() - alone, 1, [&](std::size_t i, std::size_t, std::size_t) {
    const std::size_t c = order[alone + i];
    ExecutionContext part(&context, 1, &progress, share_of(c));
    solve(c, part);
    const Grace done_with(part);
    part.report(stage, 1.0);
  });
}

inline bool any_flag(const std::vector<char>& flags) {
  return std::find(flags.begin(), flags.end(), 1) != flags.end();
}

}  // namespace flipfree::unwrap
