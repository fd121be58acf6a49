#include "flipfree/distortion/seams/eliminate/cut_map.h"

#include <algorithm>
#include <array>

#include "flipfree/base/plane.h"

namespace flipfree::distortion {

CutMap cut_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
               const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  const mesh::CutMesh cut = mesh::cut_along(surface.faces, adjacency, cuts);
  CutMap map;
  const auto count = static_cast<Eigen::Index>(cut.vertex_origin.size());
  map.surface.faces = cut.faces;
  map.surface.vertices.resize(count, 3);
  map.uv.resize(count, 2);
  for (Eigen::Index v = 0; v < count; ++v) {
    map.surface.vertices.row(v) =
        surface.vertices.row(cut.vertex_origin[static_cast<std::size_t>(v)]);
  }
  for (auto c = static_cast<CornerId>(corner_uv.rows()) - 1; c >= 0; --c)
    map.uv.row(cut.faces(c / 3, c % 3)) = corner_uv.row(c);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o < h || !cuts[static_cast<std::size_t>(h)]) continue;
    const auto vector = [&](CornerId from, CornerId to) -> Vector2 {
      return (map.uv.row(cut.faces(to / 3, to % 3)) - map.uv.row(cut.faces(from / 3, from % 3)))
          .transpose();
    };
    const Vector2 a = vector(h, next_corner(h));
    const Vector2 b = vector(next_corner(o), o);
    // |R^k a - b| is least where their product is largest.
    const std::array<double, 4> product = {a.dot(b), cross(a, b), -a.dot(b), -cross(a, b)};
    const auto best = std::max_element(product.begin(), product.end()) - product.begin();
    map.seams.push_back({h, o, static_cast<Index>(best)});
  }
  return map;
}

std::vector<StraightEdge> straight_boundary(const CutMap& map, const mesh::Adjacency& adjacency) {
  std::vector<StraightEdge> edges;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    const HalfedgeId n = next_corner(h);
    const Vector2 along =
        (map.uv.row(map.surface.faces(n / 3, n % 3)) - map.uv.row(map.surface.faces(h / 3, h % 3)))
            .transpose();
    const std::array<double, 4> forward = {along.x(), along.y(), -along.x(), -along.y()};
    const auto best = std::max_element(forward.begin(), forward.end()) - forward.begin();
    edges.push_back({h, static_cast<Index>(best)});
  }
  return edges;
}

}  // namespace flipfree::distortion
