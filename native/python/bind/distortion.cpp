#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/distortion/improve.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {

void bind_distortion(py::module_& module) {
  module.def(
      "improve",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const Array<Index>& pin_corners, const Array<double>& pin_uv, bool keep_bijective,
         int iterations, double tolerance, double max_seconds, int threads) {
        distortion::ImproveOptions options;
        options.pins = to_corner_pins(pin_corners, pin_uv);
        options.keep_bijective = keep_bijective;
        options.max_iterations = iterations;
        options.tolerance = tolerance;
        options.max_seconds = max_seconds;
        return start_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options = std::move(options)](ExecutionContext& context) {
              return distortion::improve(surface, uv, options, context);
            },
            [](const certify::Parametrization& map) -> py::object { return to_dict(map); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("pin_corners"),
      py::arg("pin_uv"), py::arg("keep_bijective"), py::arg("iterations"), py::arg("tolerance"),
      py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
