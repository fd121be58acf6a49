// Quads from a surface, and from a map.
#include "flipfree/quads/quads.h"

#include <array>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/certify/parametrization.h"
#include "flipfree/quads/box_tree.h"
#include "flipfree/quads/tiles.h"
#include "job.h"

namespace flipfree::python {

using namespace pybind11::literals;

namespace {

constexpr const char* kMissing = "The quads were not reached";

// A map as it is stored.
certify::Parametrization map_of(const mesh::Surface& surface, const Points2f& uv) {
  certify::Parametrization map;
  map.surface = surface;
  map.uv32 = uv;
  certify::set_identity_provenance(map);
  return map;
}

// The faces that are nearest to points, and the weights there.
auto nearest(const Points3& vertices, const Triangles& faces, const Points3& points) {
  std::vector<std::array<Vector3, 3>> triangles;
  for (const auto& face : faces.rowwise())
    triangles.push_back({vertices.row(face[0]), vertices.row(face[1]), vertices.row(face[2])});
  const quads::BoxTree tree(std::move(triangles));
  std::vector<FaceId> parents;
  Points3 weights(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const quads::BoxTree::Nearest found = tree.nearest(points.row(i).transpose());
    parents.push_back(static_cast<FaceId>(found.triangle));
    weights.row(i) = found.weights.transpose();
  }
  return std::tuple(std::move(parents), std::move(weights));
}

quads::QuadOptions read_quad_options(OptionReader& read) {
  quads::QuadOptions options;
  FLIPFREE_READ(read, options, target, edge_length, features, sizing, adaptive, with_map);
  return options;
}

quads::TileOptions read_tiles(OptionReader& read) {
  quads::TileOptions options;
  FLIPFREE_READ(read, options, tile, prefer_translations, features, max_seconds);
  return options;
}

}  // namespace

py::object to_python(quads::QuadCertificate&& c) {
  return py::dict("ok"_a = c.ok, "vertices"_a = c.vertices, "quads"_a = c.quads,
                  "components"_a = c.components, "genus"_a = c.genus, "borders"_a = c.borders,
                  "irregular"_a = std::move(c.irregular), "valence"_a = std::move(c.valence),
                  "edge_loops"_a = c.edge_loops, "turned"_a = std::move(c.turned),
                  "to_surface"_a = c.to_surface, "to_quads"_a = c.to_quads,
                  "failures"_a = std::move(c.failures));
}

py::object to_python(quads::QuadMesh&& mesh) {
  std::vector<Index> corners;
  for (const quads::Quad& quad : mesh.quads)
    corners.insert(corners.end(), quad.begin(), quad.end());
  return py::dict("vertices"_a = std::move(mesh.vertices),
                  "quads"_a = py::object(py::cast(std::move(corners)).attr("reshape")(-1, 4)),
                  "parent_face"_a = std::move(mesh.parent_face),
                  "barycentric"_a = std::move(mesh.barycentric),
                  "quad_parent"_a = std::move(mesh.quad_parent), "map"_a = std::move(mesh.map),
                  "stats"_a = mesh.stats, "certificate"_a = std::move(mesh.certificate));
}

void bind_quads(py::module_& module) {
  module.def("nearest", &nearest, py::call_guard<py::gil_scoped_release>());
  def_job(module, "quads", kMissing, "or ask for fewer quads",
          prepared(&quads::quads_of_surface, option<std::optional<field::GivenField>>("field"),
                   read_quad_options));
  const auto judge = [](const auto& surface, const Points3& vertices, const auto& corners,
                        const auto& parent_face, const Points3& barycentric,
                        const auto& quad_parent, auto& context) {
    std::vector<quads::Quad> quads;
    for (std::size_t i = 0; i + 3 < corners.size(); i += 4)
      quads.push_back({corners[i], corners[i + 1], corners[i + 2], corners[i + 3]});
    return quads::certify_quads(
        {&surface, &vertices, &quads, &parent_face, &barycentric, &quad_parent, nullptr, -1},
        context);
  };
  using Ids = std::vector<Index>;
  def_job(
      module, "certify_quads", "The quads were not judged", "or ask for fewer quads",
      prepared(judge, option<Points3>("vertices"), option<Ids>("quads"), option<Ids>("parent_face"),
               option<Points3>("barycentric"), option<Ids>("quad_parent")));
  const auto uv32 = option<Points2f>("uv32");
  const auto of_map = [](const auto& surface, const Points2f& uv, const auto& options,
                         auto& context) {
    return quads::quads_of_map(map_of(surface, uv), surface, options, context);
  };
  def_job(module, "quads_from_map", kMissing, "or take a map of fewer cells",
          prepared(of_map, uv32, read_quad_options));
  const auto fit = [](const auto& surface, const Points2f& uv, const auto& options, auto& context) {
    return quads::fit_tiles(map_of(surface, uv), options, context);
  };
  def_job(module, "fit_tiles", prepared(fit, uv32, read_tiles));
}

}  // namespace flipfree::python
