// A chart that is slit until it can be laid flat: where it has to give way, and its mirror
// symmetry.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// The scale factor of a surface's conformal map that keeps lengths along its open vertices, #V: u =
// 0 there, and (cotan Laplacian) u = angle defect elsewhere: to first order the logarithm by which
// lengths change at each vertex (Ben-Chen, Gotsman, Bunin 2008). Cotangents of slivers are clamped:
// only heuristics depend on them. All zero if the system cannot be solved. open: #V flags, at least
// one in every component; every vertex that is not open lies inside. Cost: one factorization with
// #V unknowns.
std::vector<double> scale_field(const mesh::Surface& surface, const std::vector<char>& open,
                                ExecutionContext& context);

// Where a surface has to give way: the hills of its scale field, and what a seam to each of them is
// worth.

struct Hill {
  VertexId peak = kInvalid;  // its highest vertex that a seam may reach
  double gain = 0.0;         // integral of (|u| - foot)^2 over the hill
  double height = 0.0;       // of its highest vertex, and where it meets a higher hill
  double foot = 0.0;
};

// The hills of |u|, those of either sign by themselves; not sorted. u: #V, zero at open vertices,
// which border hills; all others lie inside. area: #V. reach: #V flags; hills that
// no seam may reach are left out. Deterministic. Vertices are taken from the
// highest down, and where two hills meet, the lower one ends (persistence; Edelsbrunner, Letscher,
// Zomorodian 2002). Cost: O(#V log #V).
std::vector<Hill> hills(const mesh::Surface& surface, const std::vector<double>& u,
                        const std::vector<double>& area, const std::vector<char>& reach);

// Where an automatic cut is too short: the extremities of a chart (fingers, legs, horns), which a
// flat map would have to shrink by orders of magnitude.
//
// They are found from the scale factor of the conformal map that keeps the length of the boundary:
// u = 0 there, and (cotan Laplacian) u = angle defect inside, one sparse solve (Ben-Chen, Gotsman,
// Bunin 2008, who place cones at its extrema; here they become ends of slits, as in Gu, Gortler and
// Hoppe 2002, where the largest distortion of a map says where its cut has to grow).

// Flags of edges: slits along shortest paths from the boundary, or from earlier slits, to every
// peak of |u| that is high and stands out; all zero where a flat map is mild without them. The
// chart cut along them stays connected and planar. `uncuttable` as in planar_cut(). Precondition:
// connected, planar, with a boundary. Cost: a few rounds of one factorization with #V unknowns and
// O(#F log #F).
mesh::EdgeFlags cut_to_extremities(const mesh::Surface& chart, const mesh::EdgeFlags& uncuttable,
                                   ExecutionContext& context);

// A plane that maps the chart to itself.
struct Mirror {
  std::vector<VertexId> image;   // per vertex: its mirror image; itself on the plane
  std::vector<HalfedgeId> edge;  // per half-edge: one of the mirrored edge's; kInvalid: none
  std::vector<int> side;  // per half-edge: on which side its edge lies, 1 or -1; 0 in the middle

  bool empty() const { return image.empty(); }
};

// For charts of which no mirror symmetry is looked for.
inline const Mirror kNoMirror;

// Planes through the middle of the vertices across an axis of the coordinates (x, y, z), or of the
// vertices' spread, are tried in this order; the first is taken that maps all vertices to vertices,
// to a hundred-thousandth of the size, all edges that may be seams to such edges, and borders to
// borders. The diagonals of polygons need not match, as long as their cost is infinite. Empty where
// there is none, or costs differ, as where one side is painted. cost: per half-edge. Cost: O(#F).
Mirror find_mirror(const mesh::Surface& chart, const std::vector<double>& cost);

// Costs that are the same on both sides; less on the plane; all as they are without a mirror.
// Cost: O(#F).
std::vector<double> mirrored_costs(const Triangles& faces, const Mirror& mirror,
                                   std::vector<double> cost);

// What a seam costs at most where it must not be, but there is no other way.
inline constexpr double kForbidden = 1e6;
// Costs per half-edge that are never nothing, and at most that for an edge's length.
std::vector<double> positive(const mesh::Surface& surface, std::vector<double> cost);

// The chart with its holes filled by fans, which cost nothing to cross, but for the longest loop;
// or all its holes are open as that loop is. A closed chart is open at one vertex to begin with.
class Sheet {
 public:
  enum class Holes { kFilled, kOpen };

  // chart: connected, planar; must outlive this. cost: per half-edge, both sides the same, infinite
  // where no slit may run. mirror: of the chart, may be empty; otherwise every slit comes with its
  // image, as far as that leads to what is open.
  Sheet(const mesh::Surface& chart, const std::vector<double>& cost,
        const Mirror& mirror = kNoMirror, Holes holes = Holes::kFilled);

  // A closed chart is slit between two hills: no slit ends in the middle of nowhere. True if it had
  // to be opened anyhow.
  bool open_closed(ExecutionContext& context);
  // A closed chart has to be opened, also where there is no time to choose where. True if it was.
  bool open_anyhow(ExecutionContext& context);

  // The scale field for what is open now, #V of the filled chart.
  std::vector<double> scale(ExecutionContext& context) const;
  // What the energy of the conformal map with this scale exceeds 1 by, at the best unit.
  double excess(const std::vector<double>& u) const;
  // Slits to the hills that are worth most for their length. False if there is none.
  bool slit_best(const std::vector<double>& u, std::size_t most, ExecutionContext& context);
  // The shortest slit to a vertex from what is open; nothing where there is no way.
  void slit_to(VertexId end, ExecutionContext& context);
  // A shortest slit between two vertices, one of which is open. The same vertex twice: where a
  // closed chart is opened first. False if there is no way.
  bool slit_between(VertexId end, VertexId begin, ExecutionContext& context);

  const mesh::EdgeFlags& cut() const { return cut_; }

  // The slits' parts on the chart, each along vertices from its end to where it began, in the order
  // in which they were made; where a closed chart was opened first is a slit of one vertex.
  std::vector<std::vector<VertexId>> made() const;

 private:
  using Loops = std::vector<std::vector<HalfedgeId>>;
  // Along a slit, also across holes.
  struct Way {
    std::vector<VertexId> vertices;  // of the filled chart
    std::vector<HalfedgeId> edges;   // between them
  };

  VertexId steepest(const std::vector<double>& u, VertexId otherwise) const;
  int edges_to(VertexId v) const;
  void open_vertex(VertexId v);
  void slit_image(const Way& way);
  VertexId nearest_on_plane(VertexId v, const ExecutionContext& context) const;
  void take(Way way);

  const mesh::Surface& chart_;
  const Mirror& mirror_;
  Loops loops_;  // of the chart, the outer one last
  HalfedgeId real_;
  mesh::Surface surface_;
  const mesh::Adjacency& adjacency_;
  std::vector<double> cost_;
  std::vector<double> area_;  // per vertex, a share of the chart's
  std::vector<char> open_;    // on the outside, or on what leads there
  std::vector<Index> loop_of_;
  mesh::EdgeFlags cut_;
  mesh::ShortestPaths paths_;
  std::vector<Way> ways_;
};

}  // namespace flipfree::unwrap
