#include "flipfree/mesh/separated/polygons.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/separated/edge_pairs.h"

namespace flipfree::mesh {
namespace {

std::pair<VertexId, VertexId> ends(const Triangles& faces, HalfedgeId h) {
  return std::minmax({source(faces, h), target(faces, h)});
}

// Half-edges of one group and between the same vertices, where there are just two of them.
template <typename Group>
std::vector<std::pair<HalfedgeId, HalfedgeId>> twos(const Triangles& faces,
                                                    std::vector<HalfedgeId> halfedges,
                                                    Group group) {
  const auto key = [&](HalfedgeId h) { return std::pair(group(h), ends(faces, h)); };
  std::sort(halfedges.begin(), halfedges.end(), [&](HalfedgeId g, HalfedgeId h) {
    return std::pair(key(g), g) < std::pair(key(h), h);
  });
  std::vector<std::pair<HalfedgeId, HalfedgeId>> found;
  for (std::size_t i = 0, next = 0; i < halfedges.size(); i = next) {
    while (next < halfedges.size() && key(halfedges[next]) == key(halfedges[i])) ++next;
    if (next - i == 2) found.emplace_back(halfedges[i], halfedges[i + 1]);
  }
  return found;
}

}  // namespace

std::vector<Index> polygons_of(const Triangles& faces, Index vertex_count,
                               const IndexPairs& diagonals) {
  const std::vector<char> flags = flag_pairs(faces, vertex_count, &diagonals);
  std::vector<HalfedgeId> flagged;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    if (flags[at(h)] != 0) flagged.push_back(h);
  }
  DisjointSets joined(static_cast<Index>(faces.rows()));
  for (const auto& [h, o] : twos(faces, std::move(flagged), [](HalfedgeId) { return 0; }))
    joined.join(h / 3, o / 3);
  std::vector<Index> polygon;
  for (FaceId f = 0; f < faces.rows(); ++f) polygon.push_back(joined.find(f));
  return polygon;
}

IndexPairs sides_of_torn_polygons(const Triangles& faces, const std::vector<Index>& polygon,
                                  const Points2f& corner_uv) {
  const auto polygon_of = [&](HalfedgeId h) { return polygon[at(h / 3)]; };
  std::vector<Index> several = polygon;
  std::sort(several.begin(), several.end());
  std::vector<Index> once;
  for (std::size_t i = 0, next = 0; i < several.size(); i = next) {
    while (next < several.size() && several[next] == several[i]) ++next;
    if (next - i == 1) once.push_back(several[i]);
  }
  std::vector<HalfedgeId> halfedges;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces.size()); ++h) {
    if (!std::binary_search(once.begin(), once.end(), polygon_of(h))) halfedges.push_back(h);
  }
  const auto inside = twos(faces, halfedges, polygon_of);
  const Points2 uv = corner_uv.cast<double>();
  std::vector<Index> torn;
  for (const auto& [h, o] : inside) {
    if (!continues_in_map(faces, uv, h, o)) torn.push_back(polygon_of(h));
  }
  if (torn.empty()) return IndexPairs(0, 2);
  std::sort(torn.begin(), torn.end());
  std::vector<char> diagonal(static_cast<std::size_t>(faces.size()), 0);
  for (const auto& [h, o] : inside) diagonal[at(h)] = diagonal[at(o)] = 1;
  std::vector<std::pair<VertexId, VertexId>> sides;
  for (const HalfedgeId h : halfedges) {
    if (diagonal[at(h)] == 0 && std::binary_search(torn.begin(), torn.end(), polygon_of(h)))
      sides.push_back(ends(faces, h));
  }
  std::sort(sides.begin(), sides.end());
  sides.erase(std::unique(sides.begin(), sides.end()), sides.end());
  IndexPairs result(static_cast<Eigen::Index>(sides.size()), 2);
  for (std::size_t i = 0; i < sides.size(); ++i)
    result.row(static_cast<Eigen::Index>(i)) << sides[i].first, sides[i].second;
  return result;
}

}  // namespace flipfree::mesh
