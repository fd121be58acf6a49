#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/in_time.h"
#include "flipfree/unwrap/packing/pack.h"
#include "flipfree/unwrap/unwrap.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {

void bind_unwrap(py::module_& module) {
  module.def(
      "unwrap",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<Index>& cuts,
         const Array<Index>& uncuttable, const Array<Index>& pin_corners,
         const Array<double>& pin_uv, bool bijective, bool may_add_cuts, bool cut_extremities,
         int iterations, double tolerance, double margin, const py::object& place_like,
         double max_seconds, int threads) {
        struct Request {
          mesh::Surface surface;
          unwrap::UnwrapOptions options;
          Points2 place_like;
        };
        Request request;
        request.surface = to_surface(vertices, faces);
        request.options.cuts = to_matrix<IndexPairs>(cuts, "cuts");
        request.options.uncuttable = to_matrix<IndexPairs>(uncuttable, "uncuttable");
        request.options.pins = to_corner_pins(pin_corners, pin_uv);
        request.options.bijective = bijective;
        request.options.may_add_cuts = may_add_cuts;
        request.options.cut_extremities = cut_extremities;
        request.options.max_iterations = iterations;
        request.options.tolerance = tolerance;
        request.options.margin = margin;
        request.options.max_seconds = max_seconds;
        const bool keep_place = !place_like.is_none();
        if (keep_place)
          request.place_like = to_matrix<Points2>(place_like.cast<Array<double>>(), "place_like");
        return start_job(
            [request = std::move(request), keep_place](ExecutionContext& context) mutable {
              if (keep_place) request.options.place_like = &request.place_like;
              return unwrap::unwrap(request.surface, request.options, context);
            },
            [](const certify::Parametrization& map) -> py::object { return to_dict(map); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("cuts"), py::arg("uncuttable"),
      py::arg("pin_corners"), py::arg("pin_uv"), py::arg("bijective"), py::arg("may_add_cuts"),
      py::arg("cut_extremities"), py::arg("iterations"), py::arg("tolerance"), py::arg("margin"),
      py::arg("place_like"), py::arg("max_seconds"), py::arg("threads"));
  module.def(
      "pack",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         double margin, bool together, bool scale_true, bool keep_bijective,
         const Array<Index>& unmoved, const Array<double>& obstacles, double density,
         const py::object& place_like, double max_seconds, int threads) {
        struct Request {
          mesh::Surface surface;
          Points2 uv;
          unwrap::PackOptions options;
          Points2 place_like;
        };
        Request request;
        request.surface = to_surface(vertices, faces);
        request.uv = to_matrix<Points2>(uv, "uv");
        unwrap::PackOptions& options = request.options;
        options.margin = margin;
        options.together = together;
        options.scale_true = scale_true;
        options.keep_bijective = keep_bijective;
        options.unmoved.assign(unmoved.data(), unmoved.data() + unmoved.size());
        options.obstacles = to_matrix<Points2>(obstacles, "obstacles");
        options.density = density;
        const bool keep_place = !place_like.is_none();
        if (keep_place)
          request.place_like = to_matrix<Points2>(place_like.cast<Array<double>>(), "place_like");
        return start_job(
            [request = std::move(request), keep_place,
             max_seconds](ExecutionContext& context) mutable {
              if (keep_place) request.options.place_like = &request.place_like;
              return in_time(context, max_seconds, "The charts were not packed",
                             "or pack fewer faces at once", [&] {
                               return unwrap::pack(request.surface, request.uv, request.options,
                                                   context);
                             });
            },
            [](const certify::Parametrization& map) -> py::object { return to_dict(map); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("margin"), py::arg("together"),
      py::arg("scale_true"), py::arg("keep_bijective"), py::arg("unmoved"), py::arg("obstacles"),
      py::arg("density"), py::arg("place_like"), py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
