#include <pybind11/stl.h>

#include <string>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/failure/in_time.h"
#include "flipfree/unwrap/packing/pack.h"
#include "flipfree/unwrap/repair/repair.h"
#include "flipfree/unwrap/seams/seams.h"
#include "flipfree/unwrap/unwrap.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {

namespace {

// The map whose places are kept, and if there is one: None is none.
struct KeptPlaces {
  explicit KeptPlaces(const py::object& place_like) : given(!place_like.is_none()) {
    if (given) uv = to_matrix<Points2>(place_like.cast<Array<double>>(), "place_like");
  }
  const Points2* get() const { return given ? &uv : nullptr; }

  bool given;
  Points2 uv;
};

void bind_unwrap_options(py::module_& module) {
  using unwrap::PackOptions;
  using unwrap::UnwrapOptions;
  py::class_<UnwrapOptions>(module, "UnwrapOptions")
      .def(py::init<>())
      .def_property("cuts", nullptr, matrix_setter(&UnwrapOptions::cuts, "cuts"))
      .def_property("uncuttable", nullptr, matrix_setter(&UnwrapOptions::uncuttable, "uncuttable"))
      .def_property("pins", nullptr, pins_setter(&UnwrapOptions::pins))
      .def_property("material", nullptr, ids_setter(&UnwrapOptions::material))
      .def_property("polygon", nullptr, ids_setter(&UnwrapOptions::polygon))
      .def_property("find_seams", nullptr,
                    [](UnwrapOptions& options, bool find) { options.seams.find = find; })
      .def_property("stretch", nullptr,
                    [](UnwrapOptions& options, double stretch) { options.seams.stretch = stretch; })
      .def_property("sharp_angle", nullptr,
                    [](UnwrapOptions& options, double angle) { options.seams.sharp_angle = angle; })
      .def_property("weighted", nullptr,
                    [](UnwrapOptions& options, const Array<Index>& edges) {
                      options.seams.weighted = to_matrix<IndexPairs>(edges, "weights");
                    })
      .def_property("weights", nullptr,
                    [](UnwrapOptions& options, const std::vector<double>& weights) {
                      options.seams.weights = weights;
                    })
      .def_readwrite("bijective", &UnwrapOptions::bijective)
      .def_readwrite("may_add_cuts", &UnwrapOptions::may_add_cuts)
      .def_readwrite("cut_extremities", &UnwrapOptions::cut_extremities)
      .def_readwrite("iterations", &UnwrapOptions::max_iterations)
      .def_readwrite("tolerance", &UnwrapOptions::tolerance)
      .def_readwrite("margin", &UnwrapOptions::margin)
      .def_readwrite("effort", &UnwrapOptions::effort)
      .def_readwrite("max_seconds", &UnwrapOptions::max_seconds);
  using unwrap::RepairOptions;
  py::class_<RepairOptions>(module, "RepairOptions")
      .def(py::init<>())
      .def_property("cuts", nullptr, matrix_setter(&RepairOptions::cuts, "cuts"))
      .def_property("uncuttable", nullptr, matrix_setter(&RepairOptions::uncuttable, "uncuttable"))
      .def_property("pins", nullptr, pins_setter(&RepairOptions::pins))
      .def_property("overlaps", nullptr,
                    [](RepairOptions& options, const std::string& name) {
                      options.overlaps = name == "keep"   ? unwrap::SelfOverlaps::kKeep
                                         : name == "open" ? unwrap::SelfOverlaps::kOpen
                                                          : unwrap::SelfOverlaps::kCut;
                    })
      .def_property("stretched", nullptr,
                    [](RepairOptions& options, const std::string& name) {
                      options.stretched = name == "improve" ? unwrap::StretchedIslands::kImprove
                                                            : unwrap::StretchedIslands::kCount;
                    })
      .def_readwrite("disjoint", &RepairOptions::disjoint)
      .def_readwrite("margin", &RepairOptions::margin)
      .def_readwrite("iterations", &RepairOptions::max_iterations)
      .def_readwrite("tolerance", &RepairOptions::tolerance)
      .def_readwrite("max_seconds", &RepairOptions::max_seconds)
      .def_readwrite("aspect", &RepairOptions::aspect);
  py::class_<PackOptions>(module, "PackOptions")
      .def(py::init<>())
      .def_readwrite("margin", &PackOptions::margin)
      .def_readwrite("together", &PackOptions::together)
      .def_readwrite("scale_true", &PackOptions::scale_true)
      .def_readwrite("keep_bijective", &PackOptions::keep_bijective)
      .def_property("unmoved", nullptr, ids_setter(&PackOptions::unmoved))
      .def_property("obstacles", nullptr, matrix_setter(&PackOptions::obstacles, "obstacles"))
      .def_property("groups", nullptr, ids_setter(&PackOptions::groups))
      .def_property("rotation", nullptr,
                    [](PackOptions& options, const std::string& name) {
                      options.rotation = name == "none"       ? unwrap::Rotation::kNone
                                         : name == "quarters" ? unwrap::Rotation::kQuarters
                                         : name == "straight" ? unwrap::Rotation::kStraight
                                                              : unwrap::Rotation::kFree;
                    })
      .def_readwrite("stack", &PackOptions::stack)
      .def_readwrite("effort", &PackOptions::effort)
      .def_readwrite("first_tile", &PackOptions::first_tile)
      .def_readwrite("tiles", &PackOptions::tiles)
      .def_readwrite("density", &PackOptions::density);
}

}  // namespace

void bind_unwrap(py::module_& module) {
  bind_unwrap_options(module);
  module.def(
      "unwrap",
      [](const Array<double>& vertices, const Array<Index>& faces,
         const unwrap::UnwrapOptions& options, const py::object& place_like, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), options = options,
             kept = KeptPlaces(place_like)](ExecutionContext& context) mutable {
              options.place_like = kept.get();
              return unwrap::unwrap(surface, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("options"), py::arg("place_like"),
      py::arg("threads"));
  module.def(
      "auto_seams",
      [](const Array<double>& vertices, const Array<Index>& faces,
         const unwrap::UnwrapOptions& options, int threads) {
        return start_job(
            [surface = to_surface(vertices, faces),
             options = options](ExecutionContext& context) mutable {
              return unwrap::find_seams(surface, options, context);
            },
            [](const IndexPairs& edges) -> py::object { return from_matrix(edges); }, threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("options"), py::arg("threads"));
  module.def(
      "pack",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const unwrap::PackOptions& options, const py::object& place_like, double max_seconds,
         int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options = options, kept = KeptPlaces(place_like),
             max_seconds](ExecutionContext& context) mutable {
              options.place_like = kept.get();
              return in_time(context, max_seconds, "The charts were not packed",
                             "or pack fewer faces at once",
                             [&] { return unwrap::pack(surface, uv, options, context); });
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("options"),
      py::arg("place_like"), py::arg("max_seconds"), py::arg("threads"));
  module.def(
      "repair",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const unwrap::RepairOptions& options, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options](ExecutionContext& context) {
              return unwrap::repair(surface, uv, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("options"), py::arg("threads"));
}

}  // namespace flipfree::python
