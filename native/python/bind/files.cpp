#include <pybind11/stl.h>

#include <string>
#include <string_view>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/mesh/files/mesh_file.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

py::tuple read(const std::string& path, const py::bytes& content) {
  mesh::MeshFile mesh;
  {
    const std::string_view bytes = content;
    const py::gil_scoped_release release;
    mesh = mesh::read_mesh(bytes, mesh::format_of(path));
  }
  return py::make_tuple(from_matrix(mesh.vertices), from_matrix(mesh.faces),
                        from_vector(mesh.polygons), from_matrix(mesh.corners),
                        from_matrix(mesh.uv));
}

py::bytes write(const std::string& path, const Array<double>& vertices, const Array<Index>& faces,
                const Array<Index>& polygons, const Array<Index>& corners, const Array<float>& uv) {
  mesh::MeshFile mesh;
  mesh.vertices = to_matrix<Points3>(vertices, "vertices");
  mesh.faces = to_matrix<Triangles>(faces, "faces");
  mesh.polygons.assign(polygons.data(), polygons.data() + polygons.size());
  mesh.corners = to_matrix<Triangles>(corners, "corners");
  mesh.uv = to_matrix<Points2f>(uv, "uv");
  std::string content;
  {
    const py::gil_scoped_release release;
    content = mesh::write_mesh(mesh, mesh::format_of(path));
  }
  return py::bytes(content);
}

}  // namespace

void bind_files(py::module_& module) {
  module.def("read_mesh", &read, py::arg("path"), py::arg("content"));
  module.def("write_mesh", &write, py::arg("path"), py::arg("vertices"), py::arg("faces"),
             py::arg("polygons"), py::arg("corners"), py::arg("uv"));
}

}  // namespace flipfree::python
