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

seamless::SeamlessOptions to_seamless_options(const py::dict& given) {
  seamless::SeamlessOptions options;
  OptionReader read(given);
  read("uncuttable", options.engine.uncuttable);
  read("engine_iterations", options.engine.metric.max_iterations);
  read_ways(read, options.which, options.boundary);
  read("loops", options.loops);
  read("optimise", options.optimise);
  read("exact", options.exact);
  read("max_iterations", options.max_iterations);
  read("max_seconds", options.max_seconds);
  read.end();
  return options;
}

}  // namespace

void read_ways(OptionReader& read, seamless::Engine& engine, seamless::Boundary& boundary) {
  using seamless::Boundary;
  using seamless::Engine;
  read.choice(
      "engine", engine,
      {{"auto", Engine::kAuto}, {"penner", Engine::kPenner}, {"padding", Engine::kPadding}});
  read.choice("boundary", boundary,
              {{"aligned", Boundary::kAligned},
               {"aligned_or_free", Boundary::kAlignedOrFree},
               {"free", Boundary::kFree}});
}

void bind_seamless(py::module_& module) {
  module.def(
      "seamless",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::object& cones,
         const py::dict& options, int threads) {
        std::optional<std::vector<Index>> turns;
        if (!cones.is_none()) turns = to_cones(cones.cast<Array<Index>>());
        return start_job(
            [surface = to_surface(vertices, faces), turns = std::move(turns),
             options = to_seamless_options(options)](ExecutionContext& context) {
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
