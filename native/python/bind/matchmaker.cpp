#include <string>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/error.h"
#include "flipfree/matchmaker/match_piece.h"
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

matchmaker::MatchRequest to_request(const py::dict& given) {
  matchmaker::MatchRequest request;
  OptionReader read(given);
  if (const py::object points = read.value("points")) {
    const auto pair = points.cast<py::tuple>();
    const std::vector<VertexId> pinned = to_ids(pair[0]);
    const matchmaker::Polygon targets = to_polygon(pair[1], "points");
    if (pinned.size() != targets.size())
      throw_invalid(ErrorCode::kBadShape, "points must give one target each.");
    for (std::size_t i = 0; i < pinned.size(); ++i)
      request.points.push_back({pinned[i], targets[i]});
  }
  if (const py::object lines = read.value("lines")) {
    for (const py::handle line : lines) {
      const auto pair = line.cast<py::tuple>();
      request.lines.push_back({to_ids(pair[0]), to_polygon(pair[1], "lines")});
    }
  }
  read("boundary_loop", request.boundary_loop);
  if (const py::object uv = read.value("boundary_uv"))
    request.boundary_uv = to_polygon(uv, "boundary_uv");
  if (const py::object paths = read.value("paths")) {
    for (const py::handle path : paths) request.paths.push_back(to_ids(path));
  }
  read("movable", request.movable);
  read.end();
  return request;
}

matchmaker::MatchOptions to_match_options(const py::dict& given) {
  using matchmaker::MatchEngine;
  matchmaker::MatchOptions options;
  OptionReader read(given);
  read("optimise", options.optimise);
  read("bijective", options.bijective);
  read("iterations", options.max_iterations);
  read("max_seconds", options.max_seconds);
  read.choice("engine", options.engine,
              {{"auto", MatchEngine::kAuto},
               {"first try", MatchEngine::kFirstTry},
               {"outline", MatchEngine::kOutline},
               {"arms", MatchEngine::kArms},
               {"matchmaker", MatchEngine::kMatchmaker}});
  read.end();
  return options;
}

}  // namespace

void bind_matchmaker(py::module_& module) {
  module.def(
      "match",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::dict& request,
         const py::dict& options, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), request = to_request(request),
             options = to_match_options(options)](ExecutionContext& context) {
              return matchmaker::match_piece(surface, request, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("request"), py::arg("options"),
      py::arg("threads"));
}

}  // namespace flipfree::python
