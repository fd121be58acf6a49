#include <pybind11/stl.h>

#include <string>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/failure.h"
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

unwrap::UnwrapOptions to_unwrap_options(const py::dict& given) {
  unwrap::UnwrapOptions options;
  OptionReader read(given);
  read("cuts", options.cuts);
  read("uncuttable", options.uncuttable);
  read("pins", options.pins);
  read("material", options.material);
  read("polygon", options.polygon);
  read("find_seams", options.seams.find);
  read("stretch", options.seams.stretch);
  read("sharp_angle", options.seams.sharp_angle);
  read("weighted", options.seams.weighted);
  read("weights", options.seams.weights);
  read("bijective", options.bijective);
  read("may_add_cuts", options.may_add_cuts);
  read("cut_extremities", options.cut_extremities);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("margin", options.margin);
  read("effort", options.effort);
  read("max_seconds", options.max_seconds);
  read.end();
  return options;
}

unwrap::RepairOptions to_repair_options(const py::dict& given) {
  using unwrap::SelfOverlaps;
  using unwrap::StretchedIslands;
  unwrap::RepairOptions options;
  OptionReader read(given);
  read("cuts", options.cuts);
  read("uncuttable", options.uncuttable);
  read("pins", options.pins);
  read.choice(
      "overlaps", options.overlaps,
      {{"cut", SelfOverlaps::kCut}, {"open", SelfOverlaps::kOpen}, {"keep", SelfOverlaps::kKeep}});
  read.choice("stretched", options.stretched,
              {{"keep", StretchedIslands::kCount}, {"improve", StretchedIslands::kImprove}});
  read("disjoint", options.disjoint);
  read("margin", options.margin);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("max_seconds", options.max_seconds);
  read("aspect", options.aspect);
  read.end();
  return options;
}

unwrap::PackOptions to_pack_options(const py::dict& given) {
  using unwrap::Rotation;
  unwrap::PackOptions options;
  OptionReader read(given);
  read("margin", options.margin);
  read("together", options.together);
  read("scale_true", options.scale_true);
  read("keep_bijective", options.keep_bijective);
  read("unmoved", options.unmoved);
  read("obstacles", options.obstacles);
  read("groups", options.groups);
  read.choice("rotation", options.rotation,
              {{"none", Rotation::kNone},
               {"quarters", Rotation::kQuarters},
               {"straight", Rotation::kStraight},
               {"free", Rotation::kFree}});
  read("stack", options.stack);
  read("effort", options.effort);
  read("first_tile", options.first_tile);
  read("tiles", options.tiles);
  read("density", options.density);
  read.end();
  return options;
}

}  // namespace

void bind_unwrap(py::module_& module) {
  module.def(
      "unwrap",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::dict& options,
         const py::object& place_like, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), options = to_unwrap_options(options),
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
      [](const Array<double>& vertices, const Array<Index>& faces, const py::dict& options,
         int threads) {
        return start_job(
            [surface = to_surface(vertices, faces),
             options = to_unwrap_options(options)](ExecutionContext& context) mutable {
              return unwrap::find_seams(surface, options, context);
            },
            [](const IndexPairs& edges) -> py::object { return from_matrix(edges); }, threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("options"), py::arg("threads"));
  module.def(
      "pack",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& uv,
         const py::dict& options, const py::object& place_like, double max_seconds, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options = to_pack_options(options), kept = KeptPlaces(place_like),
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
         const py::dict& options, int threads) {
        return start_map_job(
            [surface = to_surface(vertices, faces), uv = to_matrix<Points2>(uv, "uv"),
             options = to_repair_options(options)](ExecutionContext& context) {
              return unwrap::repair(surface, uv, options, context);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("uv"), py::arg("options"), py::arg("threads"));
}

}  // namespace flipfree::python
