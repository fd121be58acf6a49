#include "flipfree/matchmaker/finish/simplify_plane_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "flipfree/matchmaker/coarsening/remove_added.h"
#include "flipfree/matchmaker/coarsening/untangle_removal.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::matchmaker {
namespace {

// Turns, both planes in each, and Newton steps after each pass.
constexpr int kTurns = 3;
constexpr int kStepsAfterPass = 10;
// The frame's corners come first in the numbering.
constexpr Index kFrame = 3;

// One input face that holds a whole plane: then stars may be filled in any way that is positive in
// it. Its size is a power of two, so that coordinates are weights without rounding.
mesh::Surface frame_around(const Points2& points) {
  const double reach = std::max(points.cwiseAbs().maxCoeff(), 1e-300);
  const double size = std::ldexp(1.0, std::ilogb(reach) + 1);
  mesh::Surface frame;
  frame.vertices = Points3::Zero(kFrame, 3);
  frame.vertices(1, 0) = size;
  frame.vertices(2, 1) = size;
  frame.faces.resize(1, 3);
  frame.faces << 0, 1, 2;
  return frame;
}

// The map from one plane to the other, its vertices after the frame's, which no face uses.
mesh::RefinedMap framed(const mesh::Surface& frame, const Triangles& faces, const Points2& from,
                        const Points2& to) {
  mesh::RefinedMap map;
  mesh::RefinedSurface& surface = map.surface;
  const auto count = static_cast<Index>(from.rows());
  const double size = frame.vertices(1, 0);
  surface.input = &frame;
  map.uv.resize(kFrame + count, 2);
  for (VertexId v = 0; v < kFrame; ++v) {
    surface.support.push_back({{v, kInvalid, kInvalid}, {1.0, 0.0, 0.0}});
    surface.position.emplace_back(frame.vertices.row(v).transpose());
    map.uv.row(v) = to.row(0);
  }
  for (VertexId v = 0; v < count; ++v) {
    const double x = from(v, 0) / size;
    const double y = from(v, 1) / size;
    surface.support.push_back({{0, 1, 2}, {1.0 - x - y, x, y}});
    surface.position.emplace_back(from(v, 0), from(v, 1), 0.0);
    map.uv.row(kFrame + v) = to.row(v);
  }
  const Triangles shifted = faces.array() + kFrame;
  surface.mesh = mesh::EditableTriangulation(kFrame + count, shifted);
  for (FaceId f = 0; f < surface.mesh.face_slots(); ++f) surface.mesh.set_parent(f, 0);
  surface.boundary =
      mesh::boundary_loops(shifted, mesh::build_adjacency(kFrame + count, shifted)).front();
  surface.outer_boundary = surface.boundary;
  return map;
}

// One turn: vertices go, others move in the plane `to`.
void simplify_one_way(Triangles& faces, Points2& from, Points2& to, Index held,
                      ExecutionContext& context) {
  const mesh::Surface frame = frame_around(from);
  mesh::RefinedMap map = framed(frame, faces, from, to);
  const Index keep = kFrame + held;
  std::vector<VertexId> fixed(static_cast<std::size_t>(keep));
  std::iota(fixed.begin(), fixed.end(), 0);
  thin_out(map, fixed, keep, context);
  relax(map, fixed, {kStepsAfterPass, true, nullptr}, context);
  UntangleRemovalOptions untangling;
  untangling.iterations = kThoroughIterations;
  if (remove_by_untangling(map, fixed, keep, context, untangling) > 0)
    map = mesh::compacted_map(map);
  relax(map, fixed, {kStepsAfterPass, true, nullptr}, context);
  const Eigen::Index count = map.uv.rows() - kFrame;
  faces = map.surface.mesh.faces().array() - kFrame;
  to = map.uv.bottomRows(count);
  from.resize(count, 2);
  for (Eigen::Index v = 0; v < count; ++v)
    from.row(v) = map.surface.position[static_cast<std::size_t>(kFrame + v)].head(2).transpose();
}

}  // namespace

void simplify_plane_map(PlaneMap& plane, Index held, ExecutionContext& context) {
  for (int turn = 0; turn < kTurns; ++turn) {
    simplify_one_way(plane.faces, plane.before, plane.after, held, context);
    simplify_one_way(plane.faces, plane.after, plane.before, held, context);
  }
  plane.vertex.resize(static_cast<std::size_t>(plane.before.rows()));
}

}  // namespace flipfree::matchmaker
