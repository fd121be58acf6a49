#include <algorithm>
#include <set>
#include <vector>

#include "finding.h"
#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/cut_graph/cut_graph.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/unwrap/islands/islands.h"
#include "meshes.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

mesh::EdgeFlags read_flags(Bytes& bytes, const mesh::Adjacency& adjacency) {
  mesh::EdgeFlags flags(adjacency.opposite.size(), 0);
  for (Index n = bytes.below(16); n > 0; --n) {
    const HalfedgeId h = bytes.below(static_cast<Index>(flags.size()));
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid) flags[at(h)] = flags[at(o)] = 1;
  }
  return flags;
}

void check_flags(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& flags) {
  require(flags.size() == adjacency.opposite.size(), "flags of another mesh");
  for (std::size_t h = 0; h < flags.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[h];
    require(o == kInvalid ? !flags[h] : flags[h] == flags[at(o)], "the sides of an edge differ");
  }
}

mesh::Topology topology_of(Index vertices, const Triangles& faces) {
  return mesh::topology(faces, mesh::build_adjacency(vertices, faces));
}

// Corners keep their vertices, and faces of the cut mesh are joined across an edge exactly if it is
// not cut, but for edges that open nothing.
void check_cut(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
               const mesh::EdgeFlags& flags, const mesh::CutMesh& cut) {
  const auto count = static_cast<Index>(cut.vertex_origin.size());
  require(cut.faces.rows() == surface.faces.rows(), "a face was lost");
  for (CornerId c = 0; c < 3 * cut.faces.rows(); ++c) {
    const VertexId v = cut.faces(c / 3, c % 3);
    require(v >= 0 && v < count, "a corner without a vertex");
    require(cut.vertex_origin[at(v)] == surface.faces(c / 3, c % 3), "a corner changed its vertex");
  }
  const mesh::Adjacency after = mesh::build_adjacency(count, cut.faces);
  for (std::size_t h = 0; h < flags.size(); ++h) {
    const bool joined = adjacency.opposite[h] != kInvalid && !flags[h];
    if (joined) require(after.opposite[h] == adjacency.opposite[h], "an edge was opened");
    if (after.opposite[h] != kInvalid)
      require(after.opposite[h] == adjacency.opposite[h], "faces were glued anew");
  }
  mesh::ValidateOptions options;
  options.reject_zero_area = false;
  Points3 places(count, 3);
  for (Index v = 0; v < count; ++v) places.row(v) = surface.vertices.row(cut.vertex_origin[at(v)]);
  require(mesh::find_defects({places, cut.faces}, options).empty(), "the cut mesh is no manifold");
}

}  // namespace

void fuzz_cut(Bytes bytes) {
  const Index wishes = bytes.byte();
  const mesh::Surface surface = read_mesh(bytes, Kind::kAny, 60);
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  // Extremities measure lengths: as every caller, only valid surfaces are handed on.
  if (!mesh::find_defects(surface).empty()) return;
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertices, surface.faces);
  const mesh::EdgeFlags seams = read_flags(bytes, adjacency);
  ExecutionContext context;
  const TimeLimit limit(context, 20.0);

  const mesh::CutMesh cut = mesh::cut_along(surface.faces, adjacency, seams);
  check_cut(surface, adjacency, seams, cut);
  const std::vector<mesh::Chart> charts = mesh::split_into_charts(surface.vertices, cut);
  std::size_t faces = 0;
  for (const mesh::Chart& chart : charts) {
    faces += chart.faces.size();
    const mesh::Topology t =
        topology_of(static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
    require(t.components == 1, "a chart falls apart");
  }
  require(faces == at(static_cast<Index>(surface.faces.rows())), "charts do not hold every face");

  const mesh::EdgeFlags pairs = mesh::flag_edges(
      surface.faces, adjacency, mesh::flagged_edges(surface.faces, adjacency, seams));
  require(pairs == seams, "flagged_edges and flag_edges are no inverses");

  const mesh::Topology whole = mesh::topology(surface.faces, adjacency);
  if (whole.components == 1) {
    mesh::EdgeFlags graph;
    if (allowed([&] { graph = mesh::planar_cut(surface, adjacency, context); })) {
      check_flags(adjacency, graph);
      const mesh::CutMesh open = mesh::cut_along(surface.faces, adjacency, graph);
      const mesh::Topology t =
          topology_of(static_cast<Index>(open.vertex_origin.size()), open.faces);
      require(t.components == 1 && t.genus() == 0 && t.boundary_loops >= 1,
              "planar_cut left a handle, a closed surface or pieces");
      const bool planar = whole.genus() == 0 && whole.boundary_loops >= 1;
      require(planar == std::none_of(graph.begin(), graph.end(), [](char c) { return c != 0; }),
              "planar_cut cut what was planar");
    } else {
      throw Finding{"planar_cut refused a connected surface"};
    }
  }

  const mesh::EdgeFlags uncuttable =
      (wishes & 1) != 0 ? read_flags(bytes, adjacency) : mesh::EdgeFlags();
  unwrap::Islands islands;
  if (!allowed([&] {
        islands =
            unwrap::make_islands(surface, adjacency, seams, uncuttable, (wishes & 2) != 0, context);
      }))
    return;
  check_flags(adjacency, islands.cut);
  check_flags(adjacency, islands.added);
  check_cut(surface, adjacency, islands.cut, islands.mesh);
  faces = 0;
  for (const mesh::Chart& chart : islands.charts) {
    faces += chart.faces.size();
    const mesh::Topology t =
        topology_of(static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
    require(t.components == 1 && t.genus() == 0 && t.boundary_loops >= 1,
            "an island is closed, has a handle or falls apart");
    for (std::size_t v = 0; v < chart.vertices.size(); ++v) {
      require(chart.surface.vertices.row(static_cast<Eigen::Index>(v)) ==
                  surface.vertices.row(islands.mesh.vertex_origin[at(chart.vertices[v])]),
              "an island's vertex was moved");
    }
  }
  require(faces == at(static_cast<Index>(surface.faces.rows())), "islands do not hold every face");
  for (std::size_t h = 0; h < islands.added.size(); ++h)
    require(!islands.added[h] || islands.cut[h], "an added cut is no cut");
}

}  // namespace flipfree::fuzz
