#include "flipfree/embedding/progressive/planar_map.h"

#include "flipfree/base/plane.h"
#include "flipfree/embedding/disk/boundary.h"

namespace flipfree::embedding {

double polygon_area(const Points2& p) {
  double twice = 0.0;
  for (Index i = 1; i + 1 < p.rows(); ++i) {
    const Vector2 a = (p.row(i) - p.row(0)).transpose();
    const Vector2 b = (p.row(i + 1) - p.row(0)).transpose();
    twice += cross(a, b);
  }
  return twice / 2;
}

PlanarMap make_planar_map(const Triangles& faces, const std::vector<VertexId>& loop,
                          const Points2& uv, bool float32) {
  const Index n = static_cast<Index>(uv.rows());
  PlanarMap map{PlanarMesh(faces, n, loop), uv, {}, float32, {}};
  map.share.assign(static_cast<std::size_t>(faces.rows()), 1.0);
  Points2 polygon(static_cast<Index>(loop.size()), 2);
  for (std::size_t i = 0; i < loop.size(); ++i)
    polygon.row(static_cast<Index>(i)) = uv.row(loop[i]);
  map.invalid_energy = float32 ? kInvalidEnergyFloat : kInvalidEnergyDouble;
  map.unit = std::abs(polygon_area(polygon)) / static_cast<double>(faces.rows());
  if (float32) {
    const Points2 rounded = as_stored(uv);
    for (VertexId v = 0; v < n; ++v) {
      if (!map.mesh.is_boundary(v)) map.uv.row(v) = rounded.row(v);
    }
    if (rounded != map.uv) map.stored = rounded;
  }
  return map;
}

}  // namespace flipfree::embedding
