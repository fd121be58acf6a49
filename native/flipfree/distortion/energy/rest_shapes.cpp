#include "flipfree/distortion/energy/rest_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "flipfree/base/parallel.h"
#include "flipfree/distortion/energy/grain.h"

namespace flipfree::distortion {
namespace {

// Squares of areas may be no doubles.
double norm(const Vector3& v) {
  const double square = v.squaredNorm();
  return square > 1e-280 && square < 1e300 ? std::sqrt(square) : v.stableNorm();
}

// Unfolds the triangle with its longest edge on the x axis. `weight` becomes twice the true area.
RestTriangle unfold(const Vector3 (&point)[3]) {
  int base = 0;
  double longest = -1;
  for (int k = 0; k < 3; ++k) {
    const double square = (point[(k + 1) % 3] - point[k]).squaredNorm();
    if (square > longest) {
      longest = square;
      base = k;
    }
  }
  const Vector3 edge = point[(base + 1) % 3] - point[base];
  const Vector3 side = point[(base + 2) % 3] - point[base];
  const double length = std::max(edge.norm(), 1e-300);
  const double twice_area = norm(edge.cross(side));
  const double height = std::max(twice_area / length, kFlattestRest * length);
  Vector2 flat[3];
  flat[base] = Vector2(0, 0);
  flat[(base + 1) % 3] = Vector2(length, 0);
  flat[(base + 2) % 3] = Vector2(edge.dot(side) / length, height);
  const Vector2 e1 = flat[1] - flat[0];
  const Vector2 e2 = flat[2] - flat[0];
  RestTriangle rest;
  rest.determinant = 1.0 / (length * height);
  rest.gradient[0][0] = e2.y() * rest.determinant;
  rest.gradient[0][1] = -e2.x() * rest.determinant;
  rest.gradient[1][0] = -e1.y() * rest.determinant;
  rest.gradient[1][1] = e1.x() * rest.determinant;
  rest.weight = twice_area;
  return rest;
}

}  // namespace

RestShapes build_rest_shapes(const mesh::Surface& surface, const ExecutionContext& context) {
  const auto count = static_cast<std::size_t>(surface.faces.rows());
  RestShapes shapes;
  shapes.triangles.resize(count);
  std::vector<double> sums(chunk_count(count, kGrain), 0.0);
  parallel_for(context, count, kGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto row = static_cast<Eigen::Index>(f);
      Vector3 point[3];
      for (int k = 0; k < 3; ++k) {
        point[k] = surface.vertices.row(surface.faces(row, k)).transpose();
      }
      shapes.triangles[f] = unfold(point);
      sums[chunk] += shapes.triangles[f].weight;
    }
  });
  double twice_area = 0;
  for (const double sum : sums) twice_area += sum;
  shapes.length = std::sqrt(0.5 * twice_area);

  // Weights: share of the area, not below the floor; renormalised to sum to 1.
  const double floor = kLeastWeight / static_cast<double>(count);
  std::fill(sums.begin(), sums.end(), 0.0);
  parallel_for(context, count, kGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    for (std::size_t f = begin; f < end; ++f) {
      RestTriangle& rest = shapes.triangles[f];
      rest.weight = std::max(rest.weight / twice_area, floor);
      sums[chunk] += rest.weight;
      for (auto& row : rest.gradient) {
        for (double& entry : row) entry *= shapes.length;
      }
      rest.determinant *= shapes.length * shapes.length;
    }
  });
  double total = 0;
  for (const double sum : sums) total += sum;
  for (RestTriangle& rest : shapes.triangles) rest.weight /= total;
  return shapes;
}

RestShapes equilateral_rest_shapes(std::size_t count) {
  RestTriangle equilateral;
  const double root = std::sqrt(3.0);
  equilateral.gradient[0][0] = 1;
  equilateral.gradient[0][1] = -1 / root;
  equilateral.gradient[1][1] = 2 / root;
  equilateral.determinant = 2 / root;
  equilateral.weight = 1.0 / static_cast<double>(count);
  RestShapes rest;
  rest.triangles.assign(count, equilateral);
  return rest;
}

}  // namespace flipfree::distortion
