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

}  // namespace

void bind_matchmaker(py::module_& module) {
  module.def(
      "match",
      [](const Array<double>& vertices, const Array<Index>& faces,
         const Array<Index>& point_vertices, const Array<double>& point_uv, const py::list& lines,
         const Array<Index>& boundary_loop, const Array<double>& boundary_uv, const py::list& paths,
         const Array<Index>& movable, bool optimise, bool bijective, int iterations,
         const std::string& engine, double max_seconds, int threads) {
        struct Call {
          mesh::Surface surface;
          matchmaker::MatchRequest request;
          matchmaker::MatchOptions options;
        };
        Call job;
        job.surface = to_surface(vertices, faces);
        const std::vector<VertexId> pinned = to_ids(point_vertices);
        const matchmaker::Polygon targets = to_polygon(point_uv, "points");
        if (pinned.size() != targets.size())
          throw_invalid(ErrorCode::kBadShape, "points must give one target each.");
        for (std::size_t i = 0; i < pinned.size(); ++i)
          job.request.points.push_back({pinned[i], targets[i]});
        for (const py::handle& line : lines) {
          const auto pair = line.cast<py::tuple>();
          job.request.lines.push_back({to_ids(pair[0]), to_polygon(pair[1], "lines")});
        }
        job.request.boundary_loop = to_ids(boundary_loop);
        job.request.boundary_uv = to_polygon(boundary_uv, "boundary_uv");
        for (const py::handle& path : paths) job.request.paths.push_back(to_ids(path));
        job.request.movable = to_ids(movable);
        job.options.optimise = optimise;
        job.options.bijective = bijective;
        job.options.max_iterations = iterations;
        job.options.max_seconds = max_seconds;
        if (engine == "first try") job.options.engine = matchmaker::MatchEngine::kFirstTry;
        if (engine == "outline") job.options.engine = matchmaker::MatchEngine::kOutline;
        if (engine == "overlay") job.options.engine = matchmaker::MatchEngine::kOverlay;
        if (engine == "arms") job.options.engine = matchmaker::MatchEngine::kArms;
        if (engine == "matchmaker") job.options.engine = matchmaker::MatchEngine::kMatchmaker;
        return start_job(
            [job = std::move(job)](ExecutionContext& context) {
              return matchmaker::match_piece(job.surface, job.request, job.options, context);
            },
            [](const certify::Parametrization& map) -> py::object { return to_dict(map); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("point_vertices"), py::arg("point_uv"),
      py::arg("lines"), py::arg("boundary_loop"), py::arg("boundary_uv"), py::arg("paths"),
      py::arg("movable"), py::arg("optimise"), py::arg("bijective"), py::arg("iterations"),
      py::arg("engine"), py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
