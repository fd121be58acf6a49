#include <optional>
#include <string>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/seamless/penner/penner.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

using seamless::LoopTurn;
using seamless::PennerMap;

std::vector<Index> to_cones(const Array<Index>& given) {
  return {given.data(), given.data() + given.size()};
}

py::object to_object(PennerMap&& result) {
  py::dict d;
  d["map"] = to_dict(std::move(result.map));
  py::list branches;
  for (const seamless::SeamBranch& branch : result.branches) {
    const certify::Transition& t = branch.transition;
    branches.append(py::make_tuple(from_vector(branch.halfedges), t.quarter_turns,
                                   py::make_tuple(t.translation.x(), t.translation.y())));
  }
  d["branches"] = branches;
  d["loops"] = from_loops(result.loops);
  d["seam_error"] = result.seam_error;
  d["not_stored"] = py::none();
  if (result.not_stored) d["not_stored"] = result.not_stored->message;
  return d;
}

}  // namespace

void bind_seamless(py::module_& module) {
  using seamless::SeamlessOptions;
  py::enum_<seamless::Boundary>(module, "SeamlessBoundary")
      .value("aligned", seamless::Boundary::kAligned)
      .value("aligned_or_free", seamless::Boundary::kAlignedOrFree)
      .value("free", seamless::Boundary::kFree);
  py::enum_<seamless::Engine>(module, "SeamlessEngine")
      .value("auto", seamless::Engine::kAuto)
      .value("penner", seamless::Engine::kPenner)
      .value("padding", seamless::Engine::kPadding);
  py::class_<SeamlessOptions>(module, "SeamlessOptions")
      .def(py::init<>())
      .def_property("uncuttable", nullptr,
                    [](SeamlessOptions& options, const Array<Index>& edges) {
                      options.engine.uncuttable = to_matrix<IndexPairs>(edges, "uncuttable");
                    })
      .def_property(
          "engine_iterations", nullptr,
          [](SeamlessOptions& options, int count) { options.engine.metric.max_iterations = count; })
      .def_readwrite("boundary", &SeamlessOptions::boundary)
      .def_property("loops", nullptr,
                    [](SeamlessOptions& options, const py::object& loops) {
                      options.loops = to_loops(loops);
                    })
      .def_readwrite("engine", &SeamlessOptions::which)
      .def_readwrite("optimise", &SeamlessOptions::optimise)
      .def_readwrite("exact", &SeamlessOptions::exact)
      .def_readwrite("max_iterations", &SeamlessOptions::max_iterations)
      .def_readwrite("max_seconds", &SeamlessOptions::max_seconds);
  module.def(
      "seamless",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::object& cones,
         const SeamlessOptions& options, int threads) {
        std::optional<std::vector<Index>> turns;
        if (!cones.is_none()) turns = to_cones(cones.cast<Array<Index>>());
        return start_job(
            [surface = to_surface(vertices, faces), turns = std::move(turns),
             options](ExecutionContext& context) {
              return turns ? seamless::compute_seamless_map(surface, *turns, options, context)
                           : seamless::map_with_suggested_cones(surface, options, context);
            },
            [](certify::Parametrization& map) -> py::object { return to_dict(std::move(map)); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("cones"), py::arg("options"),
      py::arg("threads"));
  module.def(
      "seamless_penner",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<Index>& cones,
         const py::object& loops, const Array<Index>& uncuttable, double tolerance,
         int max_iterations, int relaxation, double max_seconds, int threads) {
        struct Request {
          mesh::Surface surface;
          std::vector<Index> cones;
          std::optional<std::vector<LoopTurn>> loops;
          seamless::PennerMapOptions options;
        };
        Request request;
        request.surface = to_surface(vertices, faces);
        request.cones = to_cones(cones);
        request.loops = to_loops(loops);
        request.options.uncuttable = to_matrix<IndexPairs>(uncuttable, "uncuttable");
        request.options.metric.tolerance = tolerance;
        request.options.metric.max_iterations = max_iterations;
        request.options.metric.relaxation = relaxation;
        request.options.metric.max_seconds = max_seconds;
        return start_job(
            [request = std::move(request)](ExecutionContext& context) {
              return seamless::compute_penner_map(request.surface, request.cones, request.loops,
                                                  request.options, context);
            },
            [](PennerMap& result) -> py::object { return to_object(std::move(result)); }, threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("cones"), py::arg("loops"),
      py::arg("uncuttable"), py::arg("tolerance"), py::arg("max_iterations"), py::arg("relaxation"),
      py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
