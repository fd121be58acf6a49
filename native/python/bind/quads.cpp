// Quads from a surface, and from a map.
#include "flipfree/quads/quads.h"

#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/quads/tiles.h"
#include "job.h"

namespace flipfree::python {
namespace {

py::dict certificate_to_python(quads::QuadCertificate&& c) {
  using namespace pybind11::literals;
  return py::dict("ok"_a = c.ok, "vertices"_a = c.vertices, "quads"_a = c.quads,
                  "components"_a = c.components, "genus"_a = c.genus, "borders"_a = c.borders,
                  "irregular"_a = std::move(c.irregular), "valence"_a = std::move(c.valence),
                  "edge_loops"_a = c.edge_loops, "turned"_a = std::move(c.turned),
                  "to_surface"_a = c.to_surface, "to_quads"_a = c.to_quads,
                  "failures"_a = std::move(c.failures));
}

py::object quads_to_python(quads::QuadMesh&& mesh) {
  using namespace pybind11::literals;
  std::vector<Index> corners;
  for (const quads::Quad& quad : mesh.quads)
    corners.insert(corners.end(), quad.begin(), quad.end());
  return py::dict("vertices"_a = std::move(mesh.vertices),
                  "quads"_a = py::object(py::cast(std::move(corners)).attr("reshape")(-1, 4)),
                  "parent_face"_a = std::move(mesh.parent_face),
                  "barycentric"_a = std::move(mesh.barycentric),
                  "quad_parent"_a = std::move(mesh.quad_parent),
                  "map"_a = mesh.map ? py::cast(*std::move(mesh.map)) : py::none(),
                  "stats"_a = to_python(mesh.stats),
                  "certificate"_a = certificate_to_python(std::move(mesh.certificate)));
}

// A map as it is stored.
certify::Parametrization map_of(const mesh::Surface& surface, const Points2f& uv) {
  certify::Parametrization map;
  map.surface = surface;
  map.uv32 = uv;
  certify::set_identity_provenance(map);
  return map;
}

quads::QuadOptions read_quad_options(OptionReader& read) {
  quads::QuadOptions options;
  read("target", options.target);
  read("edge_length", options.edge_length);
  read("features", options.features);
  read("sizing", options.sizing);
  read("adaptive", options.adaptive);
  read("with_map", options.with_map);
  return options;
}

}  // namespace
}  // namespace flipfree::python

namespace pybind11::detail {
template <>
struct type_caster<flipfree::quads::QuadMesh> {
  static constexpr auto name = const_name("object");
  static handle cast(flipfree::quads::QuadMesh&& mesh, return_value_policy, handle) {
    return flipfree::python::quads_to_python(std::move(mesh)).release();
  }
};
template <>
struct type_caster<flipfree::quads::QuadCertificate> {
  static constexpr auto name = const_name("object");
  static handle cast(flipfree::quads::QuadCertificate&& found, return_value_policy, handle) {
    return flipfree::python::certificate_to_python(std::move(found)).release();
  }
};
}  // namespace pybind11::detail

namespace flipfree::python {

void bind_quads(py::module_& module) {
  def_job(module, "quads", [](OptionReader& read) {
    using Arrays = std::tuple<Points3, std::vector<double>, std::vector<Index>>;
    return [given = read.value<std::optional<Arrays>>("field"), options = read_quad_options(read),
            max_seconds = read.value<double>("max_seconds")](const mesh::Surface& surface,
                                                             ExecutionContext& context) {
      return in_time(
          context, max_seconds, "The quads were not reached", "or ask for fewer quads", [&] {
            return quads::quads_of_surface(
                surface,
                given ? std::optional(field::GivenField{std::get<0>(*given), std::get<1>(*given),
                                                        std::get<2>(*given)})
                      : std::nullopt,
                options, context);
          });
    };
  });
  def_job(module, "certify_quads", [](OptionReader& read) {
    std::vector<quads::Quad> quads;
    const auto corners = read.value<std::vector<Index>>("quads");
    for (std::size_t i = 0; i + 3 < corners.size(); i += 4)
      quads.push_back({corners[i], corners[i + 1], corners[i + 2], corners[i + 3]});
    return [quads = std::move(quads), vertices = read.value<Points3>("vertices"),
            parent_face = read.value<std::vector<FaceId>>("parent_face"),
            barycentric = read.value<Points3>("barycentric"),
            quad_parent = read.value<std::vector<FaceId>>("quad_parent")](
               const mesh::Surface& surface, ExecutionContext& context) {
      quads::QuadRequest request;
      request.surface = &surface;
      request.vertices = &vertices;
      request.quads = &quads;
      request.parent_face = &parent_face;
      request.barycentric = &barycentric;
      request.quad_parent = &quad_parent;
      return quads::certify_quads(request, context);
    };
  });
  def_job(module, "quads_from_map", [](OptionReader& read) {
    return [uv = read.value<Points2f>("uv32"), options = read_quad_options(read),
            max_seconds = read.value<double>("max_seconds")](const mesh::Surface& surface,
                                                             ExecutionContext& context) {
      return in_time(
          context, max_seconds, "The quads were not reached", "or take a map of fewer cells",
          [&] { return quads::quads_of_map(map_of(surface, uv), surface, options, context); });
    };
  });
  def_job(module, "fit_tiles", [](OptionReader& read) {
    quads::TileOptions options;
    read("tile", options.tile);
    read("prefer_translations", options.prefer_translations);
    read("features", options.features);
    read("max_seconds", options.max_seconds);
    return [uv = read.value<Points2f>("uv32"), options](const mesh::Surface& surface,
                                                        ExecutionContext& context) {
      return quads::fit_tiles(map_of(surface, uv), options, context);
    };
  });
}

}  // namespace flipfree::python
