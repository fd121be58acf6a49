#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/error.h"
#include "flipfree/matchmaker/match_piece.h"
#include "flipfree/matchmaker/request/devices.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

matchmaker::Polygon to_polygon(const py::handle& array, const char* name) {
  const Points2 points = to_matrix<Points2>(array.cast<Array<double>>(), name);
  matchmaker::Polygon polygon;
  for (Eigen::Index i = 0; i < points.rows(); ++i) polygon.push_back(points.row(i).transpose());
  return polygon;
}

std::vector<VertexId> to_ids(const py::handle& array) {
  const auto ids = array.cast<Array<Index>>();
  return {ids.data(), ids.data() + ids.size()};
}

matchmaker::MatchEngine engine_of(const std::string& name) {
  using matchmaker::MatchEngine;
  if (name == "first try") return MatchEngine::kFirstTry;
  if (name == "outline") return MatchEngine::kOutline;
  if (name == "overlay") return MatchEngine::kOverlay;
  if (name == "arms") return MatchEngine::kArms;
  if (name == "matchmaker") return MatchEngine::kMatchmaker;
  return MatchEngine::kAuto;
}

matchmaker::Devices device_named(const std::string& name) {
  const auto& names = matchmaker::kDeviceNames;
  const auto at = std::find(names.begin(), names.end(), name) - names.begin();
  if (at == std::ssize(names))
    throw_invalid(ErrorCode::kBadOption, "There is no device " + name + ".");
  return matchmaker::Devices{1} << at;
}

void bind_request(py::module_& module) {
  using matchmaker::MatchRequest;
  py::class_<MatchRequest>(module, "MatchRequest")
      .def(py::init<>())
      .def_property("points", nullptr,
                    [](MatchRequest& request, const py::tuple& vertices_and_uv) {
                      const std::vector<VertexId> pinned = to_ids(vertices_and_uv[0]);
                      const matchmaker::Polygon targets = to_polygon(vertices_and_uv[1], "points");
                      if (pinned.size() != targets.size())
                        throw_invalid(ErrorCode::kBadShape, "points must give one target each.");
                      for (std::size_t i = 0; i < pinned.size(); ++i)
                        request.points.push_back({pinned[i], targets[i]});
                    })
      .def_property("lines", nullptr,
                    [](MatchRequest& request, const py::list& lines) {
                      for (const py::handle& line : lines) {
                        const auto pair = line.cast<py::tuple>();
                        request.lines.push_back({to_ids(pair[0]), to_polygon(pair[1], "lines")});
                      }
                    })
      .def_property("boundary_loop", nullptr, ids_setter(&MatchRequest::boundary_loop))
      .def_property("boundary_uv", nullptr,
                    [](MatchRequest& request, const Array<double>& uv) {
                      request.boundary_uv = to_polygon(uv, "boundary_uv");
                    })
      .def_property("paths", nullptr,
                    [](MatchRequest& request, const py::list& paths) {
                      for (const py::handle& path : paths) request.paths.push_back(to_ids(path));
                    })
      .def_property("movable", nullptr, ids_setter(&MatchRequest::movable));
}

void bind_match_options(py::module_& module) {
  using matchmaker::MatchOptions;
  py::class_<MatchOptions>(module, "MatchOptions")
      .def(py::init<>())
      .def_readwrite("optimise", &MatchOptions::optimise)
      .def_readwrite("bijective", &MatchOptions::bijective)
      .def_readwrite("iterations", &MatchOptions::max_iterations)
      .def_readwrite("max_seconds", &MatchOptions::max_seconds)
      .def_property(
          "engine", nullptr,
          [](MatchOptions& options, const std::string& name) { options.engine = engine_of(name); })
      // For benchmarks/match_ablation.py alone.
      .def_property("without", nullptr, [](MatchOptions& options, const py::list& devices) {
        for (const py::handle& device : devices)
          options.ablated |= device_named(device.cast<std::string>());
      });
  py::list names;
  for (const std::string_view name : matchmaker::kDeviceNames) names.append(py::str(name));
  module.attr("match_devices") = names;
}

}  // namespace

void bind_matchmaker(py::module_& module) {
  bind_request(module);
  bind_match_options(module);
  module.def(
      "match",
      [](const Array<double>& vertices, const Array<Index>& faces,
         const matchmaker::MatchRequest& request, const matchmaker::MatchOptions& options,
         int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), request, options](ExecutionContext& context) {
              return matchmaker::match_piece(surface, request, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("request"), py::arg("options"),
      py::arg("threads"));
}

}  // namespace flipfree::python
