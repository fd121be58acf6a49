#include <pybind11/stl.h>

#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/distortion/improve.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {

void bind_distortion(py::module_& module) {
  using distortion::ImproveOptions;
  py::class_<ImproveOptions>(module, "ImproveOptions")
      .def(py::init<>())
      .def_property(
          "pins", nullptr,
          [](ImproveOptions& options, const std::pair<Array<Index>, Array<double>>& pins) {
            options.pins = to_corner_pins(pins.first, pins.second);
          })
      .def_readwrite("keep_bijective", &ImproveOptions::keep_bijective)
      .def_readwrite("iterations", &ImproveOptions::max_iterations)
      .def_readwrite("tolerance", &ImproveOptions::tolerance)
      .def_readwrite("max_seconds", &ImproveOptions::max_seconds);
  module.def(
      "improve",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const ImproveOptions& options, int threads) {
        return start_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options](ExecutionContext& context) {
              return distortion::improve(surface, uv, options, context);
            },
            [](const certify::Parametrization& map) -> py::object { return to_dict(map); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("options"), py::arg("threads"));
}

}  // namespace flipfree::python
