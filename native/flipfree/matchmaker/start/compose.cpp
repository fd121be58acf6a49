#include "flipfree/matchmaker/start/compose.h"

#include <cstddef>
#include <vector>

#include "flipfree/embedding/embed.h"
#include "flipfree/matchmaker/target/carry.h"

namespace flipfree::matchmaker {

Points2 compose_through_disk(const mesh::RefinedSurface& surface, const TargetDomain& domain,
                             ExecutionContext& context, Stats& stats) {
  const std::size_t n = domain.outline.size();
  std::vector<VertexId> loop;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < n; ++i) {
    loop.push_back(domain.mesh_vertex[static_cast<std::size_t>(domain.outline[i])]);
    lengths.push_back((domain.point[static_cast<std::size_t>(domain.outline[(i + 1) % n])] -
                       domain.point[static_cast<std::size_t>(domain.outline[i])])
                          .norm());
  }
  const Points2 circle =
      embedding::place_boundary(embedding::BoundaryShape::kCircle, lengths).positions;
  std::vector<Vector2> place(domain.point.size());
  for (std::size_t i = 0; i < n; ++i) {
    place[static_cast<std::size_t>(domain.outline[i])] =
        circle.row(static_cast<Eigen::Index>(i)).transpose();
  }
  embedding::EmbedOptions options;
  options.float32 = false;
  const Points2 disk = embedding::embed_disk(surface.mesh.faces(), surface.mesh.vertex_count(),
                                             loop, circle, options, context, stats);
  // Where it lies in the disk, carried along as the disk becomes the target.
  return Carrier(surface, disk, domain, place, context).vertices(domain.point);
}

}  // namespace flipfree::matchmaker
