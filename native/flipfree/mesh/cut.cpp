#include "flipfree/mesh/cut.h"

#include <algorithm>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/islands.h"

namespace flipfree::mesh {

void throw_no_edge(std::string message, VertexId a, VertexId b, Index vertex_count) {
  std::vector<Index> existing{a, b};
  std::erase_if(existing, [&](VertexId v) { return v < 0 || v >= vertex_count; });
  throw_invalid(ErrorCode::kNotAnEdge, std::move(message), ElementKind::kVertex, existing);
}

void throw_not_an_edge(const IndexPairs& vertex_pairs, Eigen::Index i, Index vertex_count) {
  const VertexId a = vertex_pairs(i, 0), b = vertex_pairs(i, 1);
  throw_no_edge("Cut " + std::to_string(i) + " (vertices " + vertex_id(a) + " and " + vertex_id(b) +
                    ") is not an edge of the mesh. Give pairs of vertices that an edge joins.",
                a, b, vertex_count);
}

EdgeFlags flag_edges(const Triangles& faces, const Adjacency& adjacency,
                     const IndexPairs& vertex_pairs) {
  EdgeFlags flags(adjacency.opposite.size(), 0);
  const auto vertex_count = static_cast<Index>(adjacency.vertex_halfedge.size());
  const auto outgoing = [&](VertexId from, VertexId to) {
    HalfedgeId found = kInvalid;
    for_each_outgoing(adjacency, from, [&](HalfedgeId h) {
      if (target(faces, h) == to) found = h;
    });
    return found;
  };
  for (Eigen::Index i = 0; i < vertex_pairs.rows(); ++i) {
    const VertexId a = vertex_pairs(i, 0);
    const VertexId b = vertex_pairs(i, 1);
    const bool in_range = a >= 0 && b >= 0 && a < vertex_count && b < vertex_count;
    // A boundary edge has a half-edge in one direction only.
    HalfedgeId h = in_range ? outgoing(a, b) : kInvalid;
    if (h == kInvalid && in_range) h = outgoing(b, a);
    if (h == kInvalid) throw_not_an_edge(vertex_pairs, i, vertex_count);
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid) continue;
    flags[at(h)] = flags[at(o)] = 1;
  }
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

Components components_between(Adjacency adjacency, const EdgeFlags& cut) {
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) adjacency.opposite[h] = kInvalid;
  }
  return face_components(adjacency);
}

CutMesh cut_along(const Triangles& faces, const Adjacency& adjacency, const EdgeFlags& cut) {
  CutMesh result;
  result.faces = Triangles::Constant(faces.rows(), 3, kInvalid);
  const auto crosses = [&](HalfedgeId h) {
    return adjacency.opposite[at(h)] != kInvalid && !cut[at(h)];
  };
  for (HalfedgeId corner = 0; corner < 3 * faces.rows(); ++corner) {
    if (result.faces(corner / 3, corner % 3) != kInvalid) continue;
    const auto id = static_cast<VertexId>(result.vertex_origin.size());
    result.vertex_origin.push_back(source(faces, corner));
    // The fan both ways from this corner, up to a cut or boundary edge, or once around.
    HalfedgeId h = corner;
    do {
      result.faces(h / 3, h % 3) = id;
      const HalfedgeId p = previous_corner(h);
      h = crosses(p) ? adjacency.opposite[at(p)] : kInvalid;
    } while (h != kInvalid && h != corner);
    if (h == corner) continue;
    h = corner;
    while (crosses(h)) {
      h = next_corner(adjacency.opposite[at(h)]);
      result.faces(h / 3, h % 3) = id;
    }
  }
  return result;
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
