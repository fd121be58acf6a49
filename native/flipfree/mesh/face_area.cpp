#include "flipfree/mesh/face_area.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <Eigen/Geometry>

namespace flipfree::mesh {

bool has_area(const Points3& positions, const Triangles& faces, FaceId f) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const Vector3 a = positions.row(faces(f, 0));
  const Vector3 b = positions.row(faces(f, 1));
  const Vector3 c = positions.row(faces(f, 2));
  // The exact predicate only where the cross product could be rounding: 1e-14 is far above its
  // relative error.
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const double scale = ab.cwiseAbs().maxCoeff() * ac.cwiseAbs().maxCoeff();
  if (scale > 1e-250 && scale < 1e250 && ab.cross(ac).cwiseAbs().maxCoeff() > 1e-14 * scale &&
      ab.norm() > 1e-8 * a.norm() && ac.norm() > 1e-8 * a.norm()) {
    return true;
  }
  const auto point = [](const Vector3& p) { return Kernel::Point_3(p.x(), p.y(), p.z()); };
  return !CGAL::collinear(point(a), point(b), point(c));
}

}  // namespace flipfree::mesh
