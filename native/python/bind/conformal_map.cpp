#include <string>
#include <string_view>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/map.h"
#include "flipfree/conformal/suggest_cones.h"
#include "job.h"
#include "metric_object.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

conformal::ConformalMapOptions to_map_options(const py::dict& given) {
  using intrinsic::Refinement;
  conformal::ConformalMapOptions options;
  OptionReader read(given);
  read("cuts", options.cuts);
  read("uncuttable", options.uncuttable);
  read_metric(read, options.metric);
  read.choice(
      "refinement", options.refinement,
      {{"auto", Refinement::kAuto}, {"never", Refinement::kNever}, {"full", Refinement::kFull}});
  read_start_refinement(read, options.intrinsic_refinement);
  read.end();
  return options;
}

// {map, figures, error, metric}: error is None or {message, code, kind, elements}, with the metric;
// the map is valid only without one.
py::object to_object(conformal::ConformalMapResult&& result) {
  py::dict d;
  d["map"] = to_dict(std::move(result.map));
  py::dict figures;
  figures["angle_error"] = result.metric.angle_error;
  figures["scale_range"] = result.metric.scale_range;
  figures["flips"] = result.metric.flips.size();
  figures["iterations"] = result.metric.iterations;
  figures["bits"] = result.metric.bits;
  d["figures"] = figures;
  d["error"] = py::none();
  d["metric"] = py::none();
  if (result.failure) {
    py::dict error;
    error["message"] = result.failure->message;
    error["code"] = std::string(describe(result.failure->code));
    error["kind"] = kind_name(result.failure->kind);
    error["elements"] = from_vector(result.failure->elements);
    d["error"] = error;
    d["metric"] = python::to_object(result.metric);
  }
  return d;
}

}  // namespace

void bind_conformal_map(py::module_& module) {
  module.def(
      "conformal",
      [](const Array<double>& vertices, const Array<Index>& faces,
         const Array<double>& target_angles, const py::dict& options, const py::object& lengths,
         int threads) {
        struct Request {
          mesh::Surface surface;
          std::vector<double> target_angles;
          Points3 lengths;
          conformal::ConformalMapOptions options;
        };
        Request request;
        request.surface = to_surface(vertices, faces);
        request.target_angles.assign(target_angles.data(),
                                     target_angles.data() + target_angles.size());
        request.options = to_map_options(options);
        const bool own_lengths = !lengths.is_none();
        if (own_lengths)
          request.lengths = to_matrix<Points3>(lengths.cast<Array<double>>(), "lengths");
        return start_job(
            [request = std::move(request), own_lengths](ExecutionContext& context) {
              return conformal::conformal_map(request.surface,
                                              own_lengths ? &request.lengths : nullptr,
                                              request.target_angles, request.options, context);
            },
            [](conformal::ConformalMapResult& result) -> py::object {
              return to_object(std::move(result));
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("target_angles"), py::arg("options"),
      py::arg("lengths"), py::arg("threads"));
  module.def(
      "suggest_cones",
      [](const Array<double>& vertices, const Array<Index>& faces, double bound, int max_cones,
         double quantum, double least_angle, double max_seconds, int threads) {
        conformal::SuggestConesOptions options;
        options.bound = bound;
        options.max_cones = max_cones;
        options.quantum = quantum;
        options.least_angle = least_angle;
        options.max_seconds = max_seconds;
        return start_job(
            [surface = to_surface(vertices, faces), options](ExecutionContext& context) {
              return conformal::suggest_cones(surface, options, context);
            },
            [](const conformal::SuggestedCones& cones) -> py::object {
              return py::make_tuple(from_vector(cones.target_angles), from_vector(cones.cones),
                                    cones.scale_ratio, cones.bound_holds);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::kw_only(), py::arg("bound"), py::arg("max_cones"),
      py::arg("quantum"), py::arg("least_angle"), py::arg("max_seconds"), py::arg("threads"));
  module.def(
      "boundary_angles",
      [](const Array<double>& vertices, const Array<Index>& faces, const std::string& shape,
         const Array<Index>& cone_vertices, const Array<double>& cone_angles,
         const Array<Index>& corners, double max_seconds, int threads) {
        conformal::BoundaryAnglesOptions options;
        options.shape = shape == "straight" ? conformal::BoundaryGoal::kStraight
                        : shape == "circle" ? conformal::BoundaryGoal::kCircle
                                            : conformal::BoundaryGoal::kFree;
        for (py::ssize_t i = 0; i < cone_vertices.size(); ++i) {
          options.cones.emplace_back(cone_vertices.data()[i], cone_angles.data()[i]);
        }
        options.corners.assign(corners.data(), corners.data() + corners.size());
        options.max_seconds = max_seconds;
        return start_job(
            [surface = to_surface(vertices, faces), options](ExecutionContext& context) {
              return conformal::boundary_angles(surface, options, context);
            },
            [](const std::vector<double>& angles) -> py::object { return from_vector(angles); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::kw_only(), py::arg("shape"),
      py::arg("cone_vertices"), py::arg("cone_angles"), py::arg("corners"), py::arg("max_seconds"),
      py::arg("threads"));
}

}  // namespace flipfree::python
