#include "flipfree/mesh/face_area.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace flipfree::mesh {
namespace {

// Thinner than kThinnest, or without an area.
bool is_thin(const Points3& positions, const Triangles& faces, FaceId f) {
  const Vector3 a = positions.row(faces(f, 0));
  Vector3 ab = positions.row(faces(f, 1)).transpose() - a;
  Vector3 ac = positions.row(faces(f, 2)).transpose() - a;
  Vector3 bc = ac - ab;
  // In a unit in which squares neither overflow nor vanish.
  const double extent =
      std::max({ab.cwiseAbs().maxCoeff(), ac.cwiseAbs().maxCoeff(), bc.cwiseAbs().maxCoeff()});
  if (!(extent > 0.0) || !std::isfinite(extent)) return true;
  const double unit = std::ldexp(1.0, -std::ilogb(extent));
  ab *= unit;
  ac *= unit;
  bc *= unit;
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), bc.squaredNorm()});
  return !(ab.cross(ac).norm() > kThinnest * longest);
}

// Of the whole surface, in a unit in which squares do not overflow.
bool have_little_area(const Points3& positions, const Triangles& faces,
                      const std::vector<FaceId>& some) {
  const double extent = positions.cwiseAbs().maxCoeff();
  if (!(extent > 0.0) || !std::isfinite(extent)) return false;
  const double unit = std::ldexp(1.0, -std::ilogb(extent));
  const auto area = [&](FaceId f) {
    const auto p = [&](int k) -> Vector3 { return unit * positions.row(faces(f, k)); };
    const Vector3 a = p(0);
    return (p(1) - a).cross(p(2) - a).norm();
  };
  double own = 0.0;
  for (const FaceId f : some) own += area(f);
  double all = 0.0;
  for (FaceId f = 0; f < faces.rows(); ++f) all += area(f);
  return own < kLittleArea * all;
}

}  // namespace

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

std::vector<FaceId> shapeless_faces(const Points3& positions, const Triangles& faces) {
  std::vector<FaceId> flat;
  std::vector<FaceId> thin_or_flat;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    if (!is_thin(positions, faces, f)) continue;
    thin_or_flat.push_back(f);
    if (!has_area(positions, faces, f)) flat.push_back(f);
  }
  const bool few =
      static_cast<double>(thin_or_flat.size()) <= kFewFaces * static_cast<double>(faces.rows());
  return few || have_little_area(positions, faces, thin_or_flat) ? thin_or_flat : flat;
}

InOwnUnit::InOwnUnit(const Surface& surface) : given_(surface) {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const VertexId v : surface.faces.triangles().reshaped()) {
    low = low.cwiseMin(surface.vertices.row(v).transpose());
    high = high.cwiseMax(surface.vertices.row(v).transpose());
  }
  // Halves first: the difference of two huge coordinates may not be finite.
  const double size = (0.5 * high - 0.5 * low).maxCoeff();
  if (!(size > 0.0) || !std::isfinite(size)) return;
  int exponent = 0;
  std::frexp(size, &exponent);
  if (std::abs(exponent) <= kOrdinaryExponent) return;
  exponent = std::min(exponent, std::numeric_limits<double>::max_exponent - 1);  // a finite unit
  unit_ = std::ldexp(1.0, exponent);
  scaled_ = surface;
  // A piece that is tiny beside its distance from the origin would overflow.
  const Vector3 largest = low.cwiseAbs().cwiseMax(high.cwiseAbs());
  const bool far = !std::isfinite(std::ldexp(largest.maxCoeff(), -exponent));
  if (far) scaled_->vertices.rowwise() -= low.transpose();
  for (double& x : scaled_->vertices.reshaped()) x = std::ldexp(x, -exponent);
}

double area_of(const Surface& surface) {
  double twice = 0.0;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f)
    twice += surface.area_vector(f).norm();
  return 0.5 * twice;
}

}  // namespace flipfree::mesh
