#include "flipfree/mesh/own_unit.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace flipfree::mesh {

InOwnUnit::InOwnUnit(const Surface& surface) : given_(surface) {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const VertexId v : surface.faces.reshaped()) {
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

}  // namespace flipfree::mesh
