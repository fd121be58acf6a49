// Meshes, files and certificates.
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/separated/separated.h"
#include "flipfree/mesh/validate.h"
#include "job.h"

namespace flipfree::python {
namespace {

auto split_fans(const Triangles& faces, const IndexPairs& cuts) {
  mesh::Fans fans = mesh::split_fans(faces, cuts);
  return std::tuple(std::move(fans.faces), std::move(fans.origin));
}

auto islands(const Triangles& faces, const std::optional<Points2f>& corner_uv) {
  mesh::Islands found = mesh::islands_of(faces, corner_uv ? &*corner_uv : nullptr);
  return std::tuple(std::move(found.first), found.nearly_joined);
}

auto separate(const Points3& vertices, const Triangles& faces, const IndexPairs& seams,
              const std::vector<Index>& materials, const std::vector<Index>& polygons) {
  mesh::SeparateOptions options;
  options.seams = &seams;
  if (!materials.empty()) options.material = &materials;
  if (!polygons.empty()) options.polygon = &polygons;
  mesh::SeparatedSurface found = mesh::separate({vertices, faces}, options, ExecutionContext());
  return std::tuple(mesh::rest_positions(found.surface), found.surface.faces.triangles(),
                    std::move(found.vertex_origin), std::move(found.face_origin),
                    std::vector<Index>(found.turned.begin(), found.turned.end()),
                    std::move(found.collapsed), std::move(found.mends));
}

auto read_mesh(const std::string& path, std::string_view content) {
  mesh::MeshFile file = mesh::read_mesh(content, mesh::format_of(path));
  return std::tuple(std::move(file.vertices), std::move(file.faces), std::move(file.polygons),
                    std::move(file.corners), std::move(file.uv));
}

py::bytes write_mesh(const std::string& path, const Points3& vertices, const Triangles& faces,
                     const std::vector<Index>& polygons, const Triangles& corners,
                     const Points2f& uv) {
  const std::string content =
      mesh::write_mesh({vertices, faces, polygons, corners, uv}, mesh::format_of(path));
  const py::gil_scoped_acquire acquire;
  return py::bytes(content);
}

// The input's vertices and faces, and where the map's faces and vertices lie in it.
using Parent = std::tuple<Points3, Triangles, std::vector<FaceId>, std::vector<FaceId>, Points3>;

auto read_certify(OptionReader& read) {
  certify::CertifyRequest request;
  FLIPFREE_READ(read, request, mirrored, find_mirrored, pins, aspect, features);
  read("cones", request.cone_angles);
  request.require_cones = read("loops", request.loops);
  read("bijective", request.require_bijective);
  read("disjoint", request.require_disjoint);
  read("seamless", request.require_seamless);
  return [request, uv = read.value<Points2>("uv"),
          parent = read.value<std::optional<Parent>>("parent")](const auto& surface,
                                                                auto& context) mutable {
    const Points2f stored = uv.cast<float>();
    if (!parent) {
      request.surface = &surface;
      request.uv = &uv;
      request.uv32 = &stored;
      return certify::certify_any(request, context);
    }
    mesh::validate(surface, {.reject_zero_area = false}, context);
    certify::Parametrization map;
    map.surface = surface;
    map.uv = uv;
    map.uv32 = stored;
    mesh::Surface input;
    std::tie(input.vertices, input.faces, map.parent_face, map.vertex_parent,
             map.vertex_barycentric) = *parent;
    certify::certify_map(map, input, request, context);
    return map.certificate;
  };
}

}  // namespace

void bind_meshes(py::module_& module) {
  const py::call_guard<py::gil_scoped_release> without_gil;
  module.def("split_fans", &split_fans, without_gil);
  module.def("islands", &islands, without_gil);
  module.def("separate", &separate, without_gil);
  module.def("read_mesh", &read_mesh, without_gil);
  module.def("write_mesh", &write_mesh, without_gil);
  def_job(module, "certify", "The map was not judged", "or certify fewer faces at once",
          read_certify);
}

}  // namespace flipfree::python
