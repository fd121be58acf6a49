#include "flipfree/seamless/padding/cut_components.h"

#include <utility>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::seamless {
namespace {

// Adds the cut of a component, given as a chart of the input.
void add_piece(const mesh::Chart& chart, const mesh::CutMesh& open, AdmissibleCut cut,
               RefinedPieces& out) {
  const auto own_count = static_cast<Index>(chart.vertices.size());
  std::vector<VertexId> name;
  for (const VertexId v : chart.vertices) name.push_back(open.vertex_origin[at(v)]);
  Points3& vertices = out.surface.vertices;
  auto next = static_cast<VertexId>(vertices.rows());
  vertices.conservativeResize(vertices.rows() + cut.surface.vertices.rows() - own_count, 3);
  for (VertexId v = own_count; v < static_cast<VertexId>(cut.surface.vertices.rows()); ++v) {
    mesh::SurfacePoint point = cut.provenance.vertex[at(v)];
    point.face = chart.faces[at(point.face)];
    out.provenance.vertex.push_back(point);
    vertices.row(next) = cut.surface.vertices.row(v);
    name.push_back(next++);
  }
  Triangles& faces = out.surface.faces;
  const Eigen::Index first = faces.rows();
  faces.conservativeResize(first + cut.surface.faces.rows(), 3);
  for (Eigen::Index f = 0; f < cut.surface.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(first + f, k) = name[at(cut.surface.faces(f, k))];
    out.provenance.face.push_back(chart.faces[at(cut.provenance.face[at(f)])]);
  }
  out.cuts.push_back(std::move(cut));
}

}  // namespace

RefinedPieces cut_components(const mesh::Surface& input, const std::vector<Index>& cones,
                             const CutMaker& make_cut, ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(input.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, input.faces);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const mesh::CutMesh open = mesh::cut_along(input.faces, adjacency, none);
  const std::vector<mesh::Chart> charts = mesh::split_into_charts(input.vertices, open);
  RefinedPieces out;
  out.surface.vertices = input.vertices;
  out.provenance.vertex.resize(at(vertex_count));
  for (CornerId c = 0; c < 3 * static_cast<Index>(input.faces.rows()); ++c)
    out.provenance.vertex[at(input.faces(c / 3, c % 3))] = {c / 3, Vector3::Unit(c % 3)};
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto count = static_cast<double>(charts.size());
    const ProgressRange range(context, static_cast<double>(i) / count,
                              static_cast<double>(i + 1) / count);
    std::vector<Index> own;
    for (const VertexId v : charts[i].vertices) own.push_back(cones[at(open.vertex_origin[at(v)])]);
    add_piece(charts[i], open, make_cut(charts[i].surface, own, charts[i].faces, context), out);
  }
  return out;
}

}  // namespace flipfree::seamless
