#include "flipfree/certify/measures/energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/face_area.h"

namespace flipfree::certify {
namespace {

// The least value with at least `share` of the weights at or below it; pairs of value and weight.
double percentile(std::vector<std::pair<double, double>> weighted, double share) {
  // Not finite sorts last: values that cannot be compared would make the order undefined.
  for (auto& [value, weight] : weighted) {
    if (!(value <= std::numeric_limits<double>::max()))
      value = std::numeric_limits<double>::infinity();
  }
  std::sort(weighted.begin(), weighted.end());
  double sum = 0.0;
  double reached = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [value, weight] : weighted) {
    reached = value;
    sum += weight;
    if (sum >= share) break;
  }
  return reached;
}

// A number as the sum of two doubles that do not overlap.
struct Pair {
  double high = 0.0;
  double low = 0.0;
};

Pair difference(double x, double y) {
  const double high = x - y;
  const double back = x - high;
  return {high, (x - (high + back)) + (back - y)};
}

Pair product(const Pair& x, const Pair& y) {
  const double high = x.high * y.high;
  const double low = std::fma(x.high, y.high, -high) + (x.high * y.low + x.low * y.high);
  return {high, low + x.low * y.low};
}

// Twice the area of a triangle so thin that its cross product has no correct digit in doubles.
double thin_area(const Vector2& p, const Vector2& q, const Vector2& r) {
  const Pair first = product(difference(q.x(), p.x()), difference(r.y(), p.y()));
  const Pair second = product(difference(q.y(), p.y()), difference(r.x(), p.x()));
  return (first.high - second.high) + (first.low - second.low);
}

// What has no shape has no distortion: no weight, unless nothing has any.
void leave_out_shapeless(const mesh::Surface& surface, Points3& parts) {
  const std::vector<FaceId> shapeless = mesh::shapeless_faces(surface.vertices, surface.faces);
  if (shapeless.size() == static_cast<std::size_t>(parts.rows())) return;
  for (const FaceId f : shapeless) parts(f, 2) = 0.0;
}

}  // namespace

Points3 symmetric_dirichlet_parts(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect) {
  Points3 parts(surface.faces.rows(), 3);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 e1 = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
    const Vector3 e2 = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
    const Vector2 q = corner_uv.row(3 * f);
    Vector2 d1 = corner_uv.row(3 * f + 1).transpose() - q;
    Vector2 d2 = corner_uv.row(3 * f + 2).transpose() - q;
    const double area2 = aspect * cross(d1, d2);
    d1.x() *= aspect;
    d2.x() *= aspect;
    // |J|^2 is a ratio of dot products and areas (Pinkall and Polthier 1993), |J^-1|^2 the same
    // with the roles swapped; for 2 x 2 matrices |J^-1| = |J| / det J.
    const double area3 = e1.cross(e2).norm();
    const double numerator = d1.squaredNorm() * e2.squaredNorm() - 2.0 * d1.dot(d2) * e1.dot(e2) +
                             d2.squaredNorm() * e1.squaredNorm();
    const double norm = numerator / (area3 * area3);
    parts(f, 0) = norm;
    if (area2 > 0.0) {
      parts(f, 1) = numerator / (area2 * area2);
    } else {
      const double area = aspect * thin_area(q, corner_uv.row(3 * f + 1).transpose(),
                                             corner_uv.row(3 * f + 2).transpose());
      parts(f, 1) = area > 0.0 ? numerator / area / area : std::numeric_limits<double>::infinity();
    }
    parts(f, 2) = 0.5 * area3;
  }
  leave_out_shapeless(surface, parts);
  return parts;
}

EnergyFigures symmetric_dirichlet(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect) {
  const Points3 parts = symmetric_dirichlet_parts(surface, corner_uv, aspect);
  double direct = 0.0;
  double inverse = 0.0;
  double area = 0.0;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    direct += parts(f, 2) * parts(f, 0);
    inverse += parts(f, 2) * parts(f, 1);
    area += parts(f, 2);
  }
  EnergyFigures figures;
  // direct s^2 + inverse / s^2 is smallest at s^4 = inverse / direct.
  figures.mean = 2.0 * std::sqrt(direct) * std::sqrt(inverse) / (4.0 * area);
  figures.scale = std::sqrt(std::sqrt(inverse) / std::sqrt(direct));
  const double s2 = figures.scale * figures.scale;
  std::vector<std::pair<double, double>> of_face;  // energy, area
  of_face.reserve(static_cast<std::size_t>(parts.rows()));
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    of_face.emplace_back((parts(f, 0) * s2 + parts(f, 1) / s2) / 4.0, parts(f, 2));
    figures.maximum = std::max(figures.maximum, of_face.back().first);
  }
  figures.percentile99 = percentile(std::move(of_face), 0.99 * area);
  return figures;
}

EnergyFigures worse_of(const EnergyFigures& a, const EnergyFigures& b) {
  EnergyFigures worse = b.mean <= a.mean ? a : b;
  worse.maximum = std::max(a.maximum, b.maximum);
  worse.percentile99 = std::max(a.percentile99, b.percentile99);
  return worse;
}

}  // namespace flipfree::certify
