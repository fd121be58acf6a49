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

embedding::EmbedSurfaceOptions to_embed_options(const py::dict& given) {
  using embedding::BoundaryShape;
  using embedding::EmbedMethod;
  embedding::EmbedSurfaceOptions options;
  OptionReader read(given);
  read.choice("shape", options.shape,
              {{"circle", BoundaryShape::kCircle},
               {"square", BoundaryShape::kSquare},
               {"triangle", BoundaryShape::kTriangle}});
  read("polygon", options.polygon);
  read("loop", options.loop);
  read("initial", options.initial);
  read.choice("method", options.method,
              {{"ladder", EmbedMethod::kLadder},
               {"progressive", EmbedMethod::kProgressive},
               {"tutte", EmbedMethod::kTutte},
               {"schnyder", EmbedMethod::kSchnyder}});
  read("start_from_tutte", options.start_from_tutte);
  read("low_distortion", options.low_distortion);
  read("optimise", options.optimise);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("max_seconds", options.max_seconds);
  read.end();
  return options;
}

}  // namespace

void bind_embedding(py::module_& module) {
  module.def(
      "embed",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::dict& options,
         int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces),
             options = to_embed_options(options)](ExecutionContext& context) {
              return embedding::embed_surface(surface, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("options"), py::arg("threads"));
}

}  // namespace flipfree::python
