#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "flipfree/unwrap/unwrap.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {

void bind_unwrap(py::module_& module) {
  module.def(
      "unwrap",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<Index>& cuts,
         const Array<Index>& uncuttable, const Array<Index>& pin_corners,
         const Array<double>& pin_uv, bool bijective, bool cut_extremities, int iterations,
         double tolerance, double margin, const py::object& place_like, int threads) {
        struct Request {
          Surface surface;
          UnwrapOptions options;
          Points2 place_like;
        };
        Request request;
        request.surface = to_surface(vertices, faces);
        request.options.cuts = to_matrix<IndexPairs>(cuts, "cuts");
        request.options.uncuttable = to_matrix<IndexPairs>(uncuttable, "uncuttable");
        request.options.pins = to_corner_pins(pin_corners, pin_uv);
        request.options.bijective = bijective;
        request.options.cut_extremities = cut_extremities;
        request.options.max_iterations = iterations;
        request.options.tolerance = tolerance;
        request.options.margin = margin;
        const bool keep_place = !place_like.is_none();
        if (keep_place)
          request.place_like = to_matrix<Points2>(place_like.cast<Array<double>>(), "place_like");
        return start_job(
            [request = std::move(request), keep_place](ExecutionContext& context) mutable {
              if (keep_place) request.options.place_like = &request.place_like;
              return unwrap(request.surface, request.options, context);
            },
            [](const Parametrization& map) -> py::object { return to_dict(map); }, threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("cuts"), py::arg("uncuttable"),
      py::arg("pin_corners"), py::arg("pin_uv"), py::arg("bijective"), py::arg("cut_extremities"),
      py::arg("iterations"), py::arg("tolerance"), py::arg("margin"), py::arg("place_like"),
      py::arg("threads"));
}

}  // namespace flipfree::python
