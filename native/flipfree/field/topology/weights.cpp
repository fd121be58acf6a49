#include "flipfree/field/topology/weights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace flipfree::field {
namespace {

constexpr double kHeaviest = 1e5;
constexpr double kLightest = 1e-5;

}  // namespace

std::vector<double> face_areas(const mesh::Surface& surface) {
  std::vector<double> area(at(static_cast<Index>(surface.faces.rows())));
  for (FaceId f = 0; at(f) < area.size(); ++f) {
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 a = Vector3(surface.vertices.row(surface.faces(f, 1))) - p;
    const Vector3 b = Vector3(surface.vertices.row(surface.faces(f, 2))) - p;
    area[at(f)] = 0.5 * a.cross(b).norm();
  }
  return area;
}

double extent_of(const mesh::Surface& surface) {
  double sum = 0.0;
  for (const double a : face_areas(surface)) sum += a;
  return std::sqrt(sum);
}

std::vector<double> edge_weights(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                 const std::vector<double>& area) {
  std::vector<double> weight(adjacency.opposite.size(), 0.0);
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || o < h) continue;
    const double square = (surface.vertices.row(mesh::target(surface.faces, h)) -
                           surface.vertices.row(mesh::source(surface.faces, h)))
                              .squaredNorm();
    const double ratio = 1.5 * square / (area[at(h / 3)] + area[at(o / 3)]);
    // Squares and areas that vanish among doubles say nothing.
    weight[at(h)] = std::isnan(ratio) ? 1.0 : std::clamp(ratio, kLightest, kHeaviest);
    weight[at(o)] = weight[at(h)];
  }
  return weight;
}

}  // namespace flipfree::field
