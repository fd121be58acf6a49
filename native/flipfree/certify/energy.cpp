#include "flipfree/certify/energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/base/plane.h"

namespace flipfree {

Points3 symmetric_dirichlet_parts(const Surface& surface, const Points2& corner_uv) {
  Points3 parts(surface.faces.rows(), 3);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 e1 = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
    const Vector3 e2 = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
    const Vector2 q = corner_uv.row(3 * f);
    const Vector2 d1 = corner_uv.row(3 * f + 1).transpose() - q;
    const Vector2 d2 = corner_uv.row(3 * f + 2).transpose() - q;
    // |J|^2 is a ratio of dot products and areas (Pinkall and Polthier 1993), |J^-1|^2 the same
    // with the roles swapped; for 2 x 2 matrices |J^-1| = |J| / det J.
    const double area3 = e1.cross(e2).norm();
    const double area2 = cross(d1, d2);
    const double numerator = d1.squaredNorm() * e2.squaredNorm() - 2.0 * d1.dot(d2) * e1.dot(e2) +
                             d2.squaredNorm() * e1.squaredNorm();
    const double norm = numerator / (area3 * area3);
    parts(f, 0) = norm;
    parts(f, 1) =
        area2 > 0.0 ? numerator / (area2 * area2) : std::numeric_limits<double>::infinity();
    parts(f, 2) = 0.5 * area3;
  }
  return parts;
}

EnergyFigures symmetric_dirichlet(const Surface& surface, const Points2& corner_uv) {
  const Points3 parts = symmetric_dirichlet_parts(surface, corner_uv);
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
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    figures.maximum = std::max(figures.maximum, (parts(f, 0) * s2 + parts(f, 1) / s2) / 4.0);
  }
  return figures;
}

}  // namespace flipfree
