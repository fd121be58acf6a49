#include "flipfree/matchmaker/start/equal_area_metric.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// Rounds in which triangles come to rest at the shapes that they have, all of one area; the first
// one aims at equilateral triangles.
constexpr int kMetricRounds = 9;
constexpr int kStepsPerMetricRound = 4;
// Weight of areas against angles.
constexpr double kAreas = 1.0;
constexpr double kLeastTriangleHeight = 0.01;

using Shape = std::array<Vector2, 3>;

double twice_area_of(const Shape& t) { return twice_area(t[0], t[1], t[2]); }

}  // namespace

mesh::Surface equal_area_metric(const mesh::RefinedSurface& surface, const Points2& uv,
                                ExecutionContext& context,
                                const std::vector<VertexId>& also_fixed) {
  mesh::Surface flat = to_surface(surface);
  const auto count = static_cast<std::size_t>(flat.faces.rows());
  Points2 here = uv;
  const auto shape = [&](std::size_t f) {
    const auto row = static_cast<Eigen::Index>(f);
    return Shape{here.row(flat.faces(row, 0)).transpose(), here.row(flat.faces(row, 1)).transpose(),
                 here.row(flat.faces(row, 2)).transpose()};
  };
  double total = 0;
  for (std::size_t f = 0; f < count; ++f) total += 0.5 * twice_area_of(shape(f));
  std::vector<char> fixed(surface.position.size(), 0);
  for (const VertexId v : surface.boundary) fixed[static_cast<std::size_t>(v)] = 1;
  for (const VertexId v : also_fixed) fixed[static_cast<std::size_t>(v)] = 1;
  std::vector<Shape> shapes(count, {Vector2(0, 0), Vector2(1, 0), Vector2(0.5, 0.75)});
  distortion::Untangler untangler(flat, fixed, context);
  distortion::UntangleOptions options;
  options.max_iterations = kStepsPerMetricRound;
  options.extra_iterations = kStepsPerMetricRound;
  options.lambda = kAreas;
  options.target_area = total;
  options.least_height = kLeastTriangleHeight;
  options.shapes = &shapes;
  for (int round = 0; round < kMetricRounds; ++round) {
    distortion::UntangleResult result = untangler.run(here, options, context);
    if (result.flips != 0) break;
    here = std::move(result.uv);
    for (std::size_t f = 0; f < count; ++f) {
      shapes[f] = shape(f);
      const double scale = 1.0 / std::sqrt(twice_area_of(shapes[f]));
      for (Vector2& p : shapes[f]) p *= scale;
    }
  }
  for (Eigen::Index v = 0; v < here.rows(); ++v)
    flat.vertices.row(v) << here(v, 0), here(v, 1), 0.0;
  return flat;
}

}  // namespace flipfree::matchmaker
