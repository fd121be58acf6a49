#include "flipfree/matchmaker/homotopy/outline_overlay.h"

#include <cstddef>
#include <optional>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/patches/embed_patches.h"
#include "flipfree/matchmaker/patches/matchmaker_pp.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// The triangle that holds p among those that the homotopy's triangle `sheet` was divided into.
FaceId part_with(const TargetDomain& domain, FaceId sheet, const Vector2& p) {
  const Mesh& mesh = domain.triangulation;
  const auto holds = [&](FaceId f) {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (numeric::orientation(domain.point[static_cast<std::size_t>(mesh.source(h))],
                               domain.point[static_cast<std::size_t>(mesh.target(h))], p) < 0)
        return false;
    }
    return true;
  };
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (mesh.alive(f) && mesh.parent(f) == sheet && holds(f)) return f;
  }
  throw InternalError("a pin is not in its sheet");
}

// The homotopy's triangulation with the pins. Its triangles stay unions of triangles: within each,
// one affine map takes the first frame to the last, and straight lines to straight lines.
TargetDomain with_pins(const OutlineHomotopy& homotopy) {
  constexpr Index kKept = TargetDomain::kFixedEdge + 1;
  TargetDomain domain = homotopy.domain();
  Mesh& mesh = domain.triangulation;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (!mesh.alive(h / 3)) continue;
    mesh.set_parent(h / 3, h / 3);
    if (mesh.mark(h) == Mesh::kUnmarked) mesh.set_mark(h, kKept);
  }
  for (const SheetPin& p : homotopy.pins())
    insert_point(domain, part_with(domain, p.face, p.pin.uv), p.pin.uv, p.pin.vertex);
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (mesh.alive(h / 3) && mesh.mark(h) == kKept) mesh.set_mark(h, Mesh::kUnmarked);
  }
  return domain;
}

}  // namespace

mesh::RefinedMap lay_onto_target(const mesh::RefinedMap& first, const OutlineHomotopy& homotopy,
                                 ExecutionContext& context, Stats& stats) {
  const TargetDomain domain = with_pins(homotopy);
  const ConvexPartition partition = merge_convex(domain);
  mesh::RefinedMap work{first.surface, {}};
  std::vector<Vector2> drawing;
  for (Eigen::Index v = 0; v < first.uv.rows(); ++v)
    drawing.emplace_back(first.uv.row(v).transpose());
  Paths paths;
  {
    const ProgressRange range(context, 0.0, 0.5);
    paths = trace_paths(work.surface, domain, partition, Paths(partition.edges.size()), context,
                        &drawing);
  }
  const ProgressRange range(context, 0.5, 1.0);
  work.uv = embed_patches(work.surface, domain, partition, paths, context, stats, &drawing);
  mesh::RefinedMap map = mesh::compacted_map(work);
  note_matchmaker(map, partition, stats);
  return map;
}

}  // namespace flipfree::matchmaker
