#include "flipfree/mesh/cut.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

void throw_no_edge(std::string message, VertexId a, VertexId b, Index vertex_count) {
  std::vector<Index> existing{a, b};
  std::erase_if(existing, [&](VertexId v) { return v < 0 || v >= vertex_count; });
  throw_invalid(ErrorCode::kNotAnEdge, std::move(message), ElementKind::kVertex, existing);
}

std::vector<char> flag_pairs(const Triangles& faces, Index vertex_count, const IndexPairs* pairs) {
  std::vector<char> flags(at(faces.size()), 0);
  if (pairs == nullptr || pairs->rows() == 0) return flags;
  const std::vector<VertexPair> sorted = sorted_pairs(*pairs);
  std::vector<char> low_end(at(vertex_count), 0);
  for (const VertexPair& pair : sorted) {
    if (pair.first >= 0 && pair.first < vertex_count) low_end[at(pair.first)] = 1;
  }
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    const VertexPair own = ends(faces, h);
    if (low_end[at(own.first)] == 0) continue;
    flags[at(h)] = std::binary_search(sorted.begin(), sorted.end(), own) ? 1 : 0;
  }
  return flags;
}

std::vector<VertexPair> pairs_of(const Triangles& faces, const std::vector<char>& flags) {
  std::vector<VertexPair> pairs;
  for (HalfedgeId h = 0; at(h) < flags.size(); ++h)
    if (flags[at(h)] != 0) pairs.push_back(ends(faces, h));
  sort_unique(pairs);
  return pairs;
}

std::vector<char> flag_each_pair(const Triangles& faces, Index vertex_count,
                                 const IndexPairs& pairs) {
  std::vector<char> flags = flag_pairs(faces, vertex_count, &pairs);
  const std::vector<VertexPair> found = pairs_of(faces, flags);
  for (Eigen::Index i = 0; i < pairs.rows(); ++i) {
    const VertexId a = pairs(i, 0), b = pairs(i, 1);
    if (!std::binary_search(found.begin(), found.end(), VertexPair(std::minmax(a, b))))
      throw_no_edge("Cut " + std::to_string(i) + " (vertices " + vertex_id(a) + " and " +
                        vertex_id(b) +
                        ") is not an edge of the mesh. Give pairs of vertices that an edge joins.",
                    a, b, vertex_count);
  }
  return flags;
}

EdgeFlags flag_edges(const Triangles& faces, const Adjacency& adjacency,
                     const IndexPairs& vertex_pairs) {
  EdgeFlags flags =
      flag_each_pair(faces, static_cast<Index>(adjacency.vertex_halfedge.size()), vertex_pairs);
  for (std::size_t h = 0; h < flags.size(); ++h)
    if (adjacency.opposite[h] == kInvalid) flags[h] = 0;
  return flags;
}

IndexPairs flagged_edges(const Triangles& faces, const Adjacency& adjacency,
                         const EdgeFlags& flags) {
  std::vector<VertexPair> pairs;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h)
    if (flags[at(h)] != 0 && h < adjacency.opposite[at(h)]) pairs.push_back(ends(faces, h));
  return rows_of(pairs);
}

EdgeFlags uv_cuts(const Adjacency& adjacency, const Points2& corner_uv) {
  EdgeFlags flags(adjacency.opposite.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid) continue;
    flags[at(h)] = corner_uv.row(h) != corner_uv.row(next_corner(o)) ||
                   corner_uv.row(next_corner(h)) != corner_uv.row(o);
  }
  return flags;
}

CutMesh fans_of(const Triangles& faces, DisjointSets& corners) {
  const std::vector<CornerId> first = corners.firsts();
  CutMesh result{Triangles(faces.rows(), 3), {}};
  VertexId* const number = result.faces.data();
  for (CornerId c = 0; at(c) < first.size(); ++c) {
    number[c] = first[at(c)] == c ? static_cast<VertexId>(result.vertex_origin.size())
                                  : number[first[at(c)]];
    if (first[at(c)] == c) result.vertex_origin.push_back(faces.data()[c]);
  }
  return result;
}

CutMesh cut_along(const Triangles& faces, const Adjacency& adjacency, const EdgeFlags& cut) {
  DisjointSets corners(static_cast<Index>(faces.size()));
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && (cut.empty() || cut[at(h)] == 0)) corners.join(h, next_corner(o));
  }
  return fans_of(faces, corners);
}

void sort_by_origin(CutMesh& mesh) {
  const std::size_t count = mesh.vertex_origin.size();
  std::vector<VertexId> order(count), rank(count), origin;
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](VertexId v) { return mesh.vertex_origin[at(v)]; });
  for (const VertexId v : order) {
    rank[at(v)] = static_cast<VertexId>(origin.size());
    origin.push_back(mesh.vertex_origin[at(v)]);
  }
  for (VertexId& v : mesh.faces.reshaped()) v = rank[at(v)];
  mesh.vertex_origin = std::move(origin);
}

std::vector<Chart> split_into_charts(const Points3& positions, const CutMesh& mesh) {
  const auto vertex_count = static_cast<Index>(mesh.vertex_origin.size());
  const Components components = face_components(build_adjacency(vertex_count, mesh.faces));
  std::vector<Chart> charts(at(components.count));
  for (FaceId f = 0; f < mesh.faces.rows(); ++f)
    charts[at(components.of_face[at(f)])].faces.push_back(f);
  std::vector<VertexId> local(at(vertex_count), kInvalid);
  for (Chart& chart : charts) {
    Part part = part_of(mesh.faces, chart.faces, local);
    chart.surface.faces = std::move(part.faces);
    chart.vertices = std::move(part.vertices);
    std::vector<VertexId> origin;
    for (const VertexId v : chart.vertices) origin.push_back(mesh.vertex_origin[at(v)]);
    chart.surface.vertices = positions(origin, Eigen::all);
  }
  return charts;
}

Surface fill_holes(const Surface& surface, const std::vector<std::vector<HalfedgeId>>& loops) {
  Eigen::Index added_faces = 0;
  for (const auto& loop : loops) added_faces += static_cast<Eigen::Index>(loop.size());
  const Eigen::Index count = surface.vertices.rows();
  Points3 vertices(count + static_cast<Eigen::Index>(loops.size()), 3);
  vertices.topRows(count) = surface.vertices;
  Triangles faces(surface.faces.rows() + added_faces, 3);
  faces.topRows(surface.faces.rows()) = surface.faces.triangles();
  Eigen::Index next_face = surface.faces.rows();
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto center = static_cast<VertexId>(count + static_cast<Eigen::Index>(i));
    Vector3 sum = Vector3::Zero();
    for (const HalfedgeId h : loops[i]) {
      sum += surface.vertices.row(source(surface.faces, h)).transpose();
      faces.row(next_face++) << target(surface.faces, h), source(surface.faces, h), center;
    }
    vertices.row(center) = (sum / static_cast<double>(loops[i].size())).transpose();
  }
  return {std::move(vertices), std::move(faces)};
}

}  // namespace flipfree::mesh
