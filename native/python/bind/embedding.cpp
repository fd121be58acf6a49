#include <pybind11/stl.h>

#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/error.h"
#include "flipfree/embedding/embed_surface.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

embedding::BoundaryShape shape_of(const std::string& name) {
  if (name == "circle") return embedding::BoundaryShape::kCircle;
  if (name == "square") return embedding::BoundaryShape::kSquare;
  if (name == "triangle") return embedding::BoundaryShape::kTriangle;
  throw_invalid(
      ErrorCode::kBadOption,
      "boundary must be \"circle\", \"square\", \"triangle\" or an array, not \"" + name + "\".");
}

embedding::EmbedMethod method_of(const std::string& name) {
  if (name == "ladder") return embedding::EmbedMethod::kLadder;
  if (name == "progressive") return embedding::EmbedMethod::kProgressive;
  if (name == "tutte") return embedding::EmbedMethod::kTutte;
  if (name == "schnyder") return embedding::EmbedMethod::kSchnyder;
  throw_invalid(ErrorCode::kBadOption,
                "method must be \"ladder\", \"schnyder\", \"progressive\" or \"tutte\", not \"" +
                    name + "\".");
}

}  // namespace

void bind_embedding(py::module_& module) {
  module.def(
      "embed",
      [](const Array<double>& vertices, const Array<Index>& faces, const std::string& shape,
         const py::object& polygon, const std::vector<VertexId>& loop, const py::object& initial,
         const std::string& method, bool start_from_tutte, bool low_distortion, bool optimise,
         int iterations, double tolerance, double max_seconds, int threads) {
        embedding::EmbedSurfaceOptions options;
        const mesh::Surface surface = to_surface(vertices, faces);
        options.shape = shape_of(shape);
        if (!polygon.is_none())
          options.polygon = to_matrix<Points2>(polygon.cast<Array<double>>(), "boundary");
        options.loop = loop;
        if (!initial.is_none())
          options.initial = to_matrix<Points2>(initial.cast<Array<double>>(), "initial_uv");
        options.method = method_of(method);
        options.start_from_tutte = start_from_tutte;
        options.low_distortion = low_distortion;
        options.optimise = optimise;
        options.max_iterations = iterations;
        options.tolerance = tolerance;
        options.max_seconds = max_seconds;
        return start_job(
            [surface, options](ExecutionContext& context) {
              return embedding::embed_surface(surface, options, context);
            },
            [](const certify::Parametrization& map) -> py::object { return to_dict(map); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("shape"), py::arg("polygon"), py::arg("loop"),
      py::arg("initial"), py::arg("method"), py::arg("start_from_tutte"), py::arg("low_distortion"),
      py::arg("optimise"), py::arg("iterations"), py::arg("tolerance"), py::arg("max_seconds"),
      py::arg("threads"));
}

}  // namespace flipfree::python
