#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/mesh/separated/fans.h"

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
        return py::make_tuple(from_matrix(fans.faces), from_vector(fans.origin));
      },
      py::arg("faces"), py::arg("cuts"));
}

}  // namespace flipfree::python
