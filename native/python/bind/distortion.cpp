#include <pybind11/stl.h>

#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/distortion/improve.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/unwrap/repair/improve_any.h"
#include "flipfree/unwrap/repair/repair.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

// A map with a cut that is seamless up to rounding, optimised and made exact.
certify::Parametrization exact_map(const mesh::Surface& surface, const Points2& uv,
                                   const IndexPairs& cut_edges,
                                   const distortion::ExactOptions& options,
                                   ExecutionContext& context) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const distortion::CutMap cut = distortion::cut_map(
      surface, adjacency, mesh::flag_edges(surface.faces, adjacency, cut_edges), uv);
  distortion::ExactMap exact = distortion::make_exact(cut, options, context);
  certify::Parametrization map;
  map.surface = surface;
  map.uv = distortion::corners_of(cut, exact.uv);
  map.uv32 = map.uv.cast<float>();
  certify::set_identity_provenance(map);
  map.cut_edges.resize(static_cast<Eigen::Index>(cut.seams.size()), 2);
  for (std::size_t e = 0; e < cut.seams.size(); ++e) {
    map.cut_edges.row(static_cast<Eigen::Index>(e)) << mesh::source(surface.faces, cut.seams[e].h),
        mesh::target(surface.faces, cut.seams[e].h);
  }
  map.transitions = std::move(exact.transitions);
  map.stats = std::move(exact.stats);
  certify::CertifyRequest request;
  request.require_seamless = true;
  request.measure_overlaps = false;
  certify::certify_map(map, surface, request, context);
  return map;
}

distortion::ImproveOptions to_improve_options(const py::dict& given) {
  distortion::ImproveOptions options;
  OptionReader read(given);
  read("pins", options.pins);
  read("keep_bijective", options.keep_bijective);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("max_seconds", options.max_seconds);
  read("aspect", options.aspect);
  read.end();
  return options;
}

}  // namespace

void bind_distortion(py::module_& module) {
  module.def(
      "improve",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const py::dict& options, bool repair, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options = to_improve_options(options), repair](ExecutionContext& context) {
              return repair ? unwrap::improve_any(surface, uv, options, context)
                            : distortion::improve(surface, uv, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("options"), py::arg("repair"),
      py::arg("threads"));
  // For benchmarks and judges: the stages after an engine for seamless maps, alone.
  module.def(
      "exact_seams",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const Array<Index>& cut_edges, bool optimise, double max_seconds, int threads) {
        distortion::ExactOptions options;
        options.optimise = optimise;
        options.max_seconds = max_seconds;
        return start_map_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             cuts = to_matrix<IndexPairs>(cut_edges, "cut_edges"),
             options](ExecutionContext& context) {
              return exact_map(surface, uv, cuts, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("cut_edges"),
      py::arg("optimise"), py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
