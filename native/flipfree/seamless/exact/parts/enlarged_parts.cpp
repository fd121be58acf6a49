#include "flipfree/seamless/exact/parts/enlarged_parts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "flipfree/mesh/topology.h"

namespace flipfree::seamless {
namespace {

struct MeasuredPart {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = Vector3::Constant(-std::numeric_limits<double>::infinity());
  Index faces = 0;
  int exponent = 0;  // binary, of what it is multiplied by

  // Half of it: the difference of two huge coordinates may not be finite.
  double half_extent() const { return (0.5 * high - 0.5 * low).maxCoeff(); }
};

std::vector<MeasuredPart> measured(const mesh::Surface& surface, const mesh::Components& parts) {
  std::vector<MeasuredPart> result(at(parts.count));
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    MeasuredPart& part = result[at(parts.of_face[at(f)])];
    ++part.faces;
    for (Index k = 0; k < 3; ++k) {
      const Vector3 p = surface.vertices.row(surface.faces(f, k)).transpose();
      part.low = part.low.cwiseMin(p);
      part.high = part.high.cwiseMax(p);
    }
  }
  return result;
}

}  // namespace

std::optional<EnlargedParts> enlarge_parts(const mesh::Surface& surface,
                                           const mesh::Adjacency& adjacency, double least_edge) {
  const mesh::Components components = mesh::face_components(adjacency);
  if (components.count < 2) return std::nullopt;
  std::vector<MeasuredPart> parts = measured(surface, components);
  double largest = 0.0;
  for (const MeasuredPart& part : parts) largest = std::max(largest, part.half_extent());
  EnlargedParts result;
  for (MeasuredPart& part : parts) {
    const double extent = part.half_extent();
    const double least = least_edge * largest * std::sqrt(static_cast<double>(part.faces));
    if (!(extent > 0.0) || extent >= least) continue;
    // The quotient itself may not be finite.
    int own = 0, wanted = 0;
    std::frexp(extent, &own);
    std::frexp(least, &wanted);
    part.exponent = wanted - own + 1;
    ++result.count;
  }
  if (result.count == 0) return std::nullopt;
  result.surface = surface;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const MeasuredPart& part = parts[at(components.of_face[at(f)])];
    if (part.exponent == 0) continue;
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = surface.faces(f, k);
      for (Index i = 0; i < 3; ++i)
        result.surface.vertices(v, i) =
            std::ldexp(surface.vertices(v, i) - part.low[i], part.exponent);
    }
  }
  return result;
}

void place_on(const mesh::Surface& surface, certify::Parametrization& map) {
  const Eigen::Index own = surface.vertices.rows();
  map.surface.vertices.topRows(own) = surface.vertices;
  for (Eigen::Index v = own; v < map.surface.vertices.rows(); ++v) {
    const FaceId f = map.vertex_parent[static_cast<std::size_t>(v)];
    Vector3 place = Vector3::Zero();
    for (Index k = 0; k < 3; ++k) {
      place += map.vertex_barycentric(v, k) * surface.vertices.row(surface.faces(f, k)).transpose();
    }
    map.surface.vertices.row(v) = place.transpose();
  }
}

}  // namespace flipfree::seamless
