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
  using Options = embedding::EmbedSurfaceOptions;
  py::class_<Options>(module, "EmbedOptions")
      .def(py::init<>())
      .def_property("shape", nullptr,
                    [](Options& o, const std::string& name) { o.shape = shape_of(name); })
      .def_property("polygon", nullptr,
                    [](Options& o, const Array<double>& polygon) {
                      o.polygon = to_matrix<Points2>(polygon, "boundary");
                    })
      .def_readwrite("loop", &Options::loop)
      .def_property("initial", nullptr,
                    [](Options& o, const Array<double>& uv) {
                      o.initial = to_matrix<Points2>(uv, "initial_uv");
                    })
      .def_property("method", nullptr,
                    [](Options& o, const std::string& name) { o.method = method_of(name); })
      .def_readwrite("start_from_tutte", &Options::start_from_tutte)
      .def_readwrite("low_distortion", &Options::low_distortion)
      .def_readwrite("optimise", &Options::optimise)
      .def_readwrite("iterations", &Options::max_iterations)
      .def_readwrite("tolerance", &Options::tolerance)
      .def_readwrite("max_seconds", &Options::max_seconds);
  module.def(
      "embed",
      [](const Array<double>& vertices, const Array<Index>& faces, const Options& options,
         int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), options](ExecutionContext& context) {
              return embedding::embed_surface(surface, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("options"), py::arg("threads"));
}

}  // namespace flipfree::python
