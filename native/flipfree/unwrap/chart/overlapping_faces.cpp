#include "flipfree/unwrap/chart/overlapping_faces.h"

#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <limits>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::unwrap {
namespace {

// Is all of g on the right of a side of f, or on it?
bool beside(const Triangles& faces, const Points2& uv, FaceId f, FaceId g) {
  for (Index k = 0; k < 3; ++k) {
    const Vector2 a = uv.row(faces(f, k)).transpose();
    const Vector2 b = uv.row(faces(f, (k + 1) % 3)).transpose();
    bool right = true;
    for (Index m = 0; m < 3 && right; ++m) {
      const VertexId v = faces(g, m);
      if (v == faces(f, k) || v == faces(f, (k + 1) % 3)) continue;
      right = numeric::orientation(a, b, uv.row(v).transpose()) <= 0;
    }
    if (right) return true;
  }
  return false;
}

// Area of the intersection, by clipping f at the sides of g (Sutherland, Hodgman 1974).
double common_area(const Triangles& faces, const Points2& uv, FaceId f, FaceId g) {
  const auto corner = [&](FaceId face, Index k) -> Vector2 {
    return uv.row(faces(face, k)).transpose();
  };
  std::vector<Vector2> polygon{corner(f, 0), corner(f, 1), corner(f, 2)};
  std::vector<Vector2> clipped;
  for (Index k = 0; k < 3; ++k) {
    const Vector2 a = corner(g, k);
    const Vector2 side = corner(g, (k + 1) % 3) - a;
    clipped.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2& p = polygon[i];
      const Vector2& q = polygon[(i + 1) % polygon.size()];
      const double from = cross(side, Vector2(p - a));
      const double to = cross(side, Vector2(q - a));
      if (from >= 0) clipped.push_back(p);
      if ((from > 0 && to < 0) || (from < 0 && to > 0))
        clipped.emplace_back(p + (q - p) * (from / (from - to)));
    }
    polygon.swap(clipped);
  }
  double area = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    area += 0.5 * cross(Vector2(polygon[i - 1] - polygon[0]), Vector2(polygon[i] - polygon[0]));
  return std::max(area, std::numeric_limits<double>::min());  // it is positive, however rounded
}

}  // namespace

std::vector<FacePair> overlapping_faces(const Triangles& faces, const Points2& uv,
                                        const ExecutionContext& context) {
  using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Index*>;
  std::vector<Box> boxes;
  boxes.reserve(static_cast<std::size_t>(faces.rows()));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    Vector2 low = uv.row(faces(f, 0)).transpose();
    Vector2 high = low;
    for (Index k = 1; k < 3; ++k) {
      low = low.cwiseMin(uv.row(faces(f, k)).transpose());
      high = high.cwiseMax(uv.row(faces(f, k)).transpose());
    }
    boxes.emplace_back(low.data(), high.data(), &faces(f, 0));
  }
  std::vector<FacePair> pairs;
  std::size_t looked_at = 0;
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Box& first, const Box& second) {
        if (++looked_at % 4096 == 0) context.check();
        const auto f = static_cast<FaceId>((first.handle() - faces.data()) / 3);
        const auto g = static_cast<FaceId>((second.handle() - faces.data()) / 3);
        if (beside(faces, uv, f, g) || beside(faces, uv, g, f)) return;
        pairs.push_back({std::min(f, g), std::max(f, g), common_area(faces, uv, f, g)});
      });
  std::sort(pairs.begin(), pairs.end(), [](const FacePair& p, const FacePair& q) {
    return p.first != q.first ? p.first < q.first : p.second < q.second;
  });
  return pairs;
}

}  // namespace flipfree::unwrap
