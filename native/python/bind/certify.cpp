#include "flipfree/certify/certify.h"
#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/mesh/validate.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {

void bind_certify(py::module_& module) {
  module.def(
      "certify",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const Array<Index>& pin_corners, const Array<double>& pin_uv,
         const Array<Index>& cone_vertices, const Array<double>& cone_angles,
         const py::object& loops, const py::object& parent, bool require_bijective,
         bool require_disjoint, bool require_seamless, double aspect, double max_seconds,
         int threads) {
        certify::Parametrization map;
        map.surface = to_surface(vertices, faces);
        map.uv = to_matrix<Points2>(uv, "uv");
        certify::CertifyRequest request;
        request.require_bijective = require_bijective;
        request.require_disjoint = require_disjoint;
        request.require_seamless = require_seamless;
        request.aspect = aspect;
        request.pins = to_corner_pins(pin_corners, pin_uv);
        for (py::ssize_t i = 0; i < cone_vertices.size(); ++i) {
          request.cone_angles.emplace_back(cone_vertices.data()[i], cone_angles.data()[i]);
        }
        if (const auto given = to_loops(loops)) {
          request.require_cones = true;
          for (const auto& turn : *given) request.loops.emplace_back(turn.loop, turn.quarter_turns);
        }
        mesh::Surface input;
        if (!parent.is_none()) {
          const auto parts = parent.cast<py::tuple>();
          input = to_surface(parts[0].cast<Array<double>>(), parts[1].cast<Array<Index>>());
          const auto parent_face = parts[2].cast<Array<Index>>();
          const auto vertex_parent = parts[3].cast<Array<Index>>();
          map.parent_face.assign(parent_face.data(), parent_face.data() + parent_face.size());
          map.vertex_parent.assign(vertex_parent.data(),
                                   vertex_parent.data() + vertex_parent.size());
          map.vertex_barycentric =
              to_matrix<Points3>(parts[4].cast<Array<double>>(), "vertex_barycentric");
        }
        return start_job(
            [map = std::move(map), input = std::move(input), request, refined = !parent.is_none(),
             max_seconds](ExecutionContext& context) mutable {
              return in_time(context, max_seconds, "The map was not judged",
                             "or certify fewer faces at once", [&] {
                               map.uv32 = map.uv.cast<float>();
                               if (refined) {
                                 mesh::validate(map.surface, {.reject_zero_area = false}, context);
                                 certify::certify_map(map, input, request, context);
                                 return map.certificate;
                               }
                               request.surface = &map.surface;
                               request.uv = &map.uv;
                               request.uv32 = &map.uv32;
                               return certify::certify_any(request, context);
                             });
            },
            [](const certify::Certificate& certificate) -> py::object {
              return to_dict(certificate);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::kw_only(), py::arg("pin_corners"),
      py::arg("pin_uv"), py::arg("cone_vertices"), py::arg("cone_angles"), py::arg("loops"),
      py::arg("parent"), py::arg("require_bijective"), py::arg("require_disjoint"),
      py::arg("require_seamless"), py::arg("aspect"), py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
