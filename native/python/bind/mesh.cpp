#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/separated/separated.h"

namespace py = pybind11;

namespace flipfree::python {

void bind_mesh(py::module_& module) {
  module.def(
      "split_fans",
      [](const Array<Index>& faces, const Array<Index>& cuts) {
        const auto triangles = to_matrix<Triangles>(faces, "faces");
        const auto pairs = to_matrix<IndexPairs>(cuts, "cuts");
        mesh::Fans fans;
        {
          const py::gil_scoped_release release;
          fans = mesh::split_fans(triangles, pairs);
        }
        return py::make_tuple(taken_matrix(std::move(fans.faces)),
                              taken_vector(std::move(fans.origin)));
      },
      py::arg("faces"), py::arg("cuts"));
  module.def(
      "islands",
      [](const Array<Index>& faces, const py::object& corner_uv) {
        const auto triangles = to_matrix<Triangles>(faces, "faces");
        Points2f uv;
        if (!corner_uv.is_none()) uv = to_matrix<Points2f>(corner_uv.cast<Array<float>>(), "uv");
        mesh::Islands found;
        {
          const py::gil_scoped_release release;
          found = mesh::islands_of(triangles, corner_uv.is_none() ? nullptr : &uv);
        }
        return py::make_tuple(taken_vector(std::move(found.first)), found.nearly_joined);
      },
      py::arg("faces"), py::arg("uv"));
  module.def(
      "separate",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<Index>& seams,
         const Array<Index>& material, const Array<Index>& polygon) {
        const mesh::Surface surface = to_surface(vertices, faces);
        const auto pairs = to_matrix<IndexPairs>(seams, "seams");
        const std::vector<Index> materials(material.data(), material.data() + material.size());
        const std::vector<Index> polygons(polygon.data(), polygon.data() + polygon.size());
        mesh::SeparateOptions options;
        options.seams = &pairs;
        if (!materials.empty()) options.material = &materials;
        if (!polygons.empty()) options.polygon = &polygons;
        const ExecutionContext context;
        mesh::SeparatedSurface separated;
        Points3 positions;
        {
          const py::gil_scoped_release release;
          separated = mesh::separate(surface, options, context);
          positions = mesh::rest_positions(separated.surface);
        }
        py::list mends;
        for (const mesh::Mend& mend : separated.mends) {
          mends.append(py::make_tuple(std::string(describe(mend.kind)), kind_name(mend.element),
                                      mend.count, from_vector(mend.elements)));
        }
        const std::vector<Index> turned(separated.turned.begin(), separated.turned.end());
        return py::make_tuple(from_matrix(positions), from_matrix(separated.surface.faces),
                              from_vector(separated.vertex_origin),
                              from_vector(separated.face_origin), from_vector(turned),
                              from_vector(separated.collapsed), mends);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("seams"), py::arg("material"),
      py::arg("polygon"));
}

}  // namespace flipfree::python
