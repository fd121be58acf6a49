#include <pybind11/stl.h>

#include <optional>
#include <tuple>
#include <utility>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/failure.h"
#include "flipfree/field/compute.h"
#include "flipfree/holonomy/engines.h"
#include "flipfree/holonomy/field_aligned.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

using field::FieldOptions;
using field::GivenField;

template <typename T>
std::vector<T> to_vector(const Array<T>& array) {
  return {array.data(), array.data() + array.size()};
}

// (directions, rotation, quarters), each of which may be empty.
GivenField to_field(const Array<double>& directions, const Array<double>& rotation,
                    const Array<Index>& quarters) {
  return {to_matrix<Points3>(directions, "directions"), to_vector(rotation), to_vector(quarters)};
}

py::tuple to_tuple(const GivenField& given) {
  return py::make_tuple(from_matrix(given.directions), from_vector(given.rotation),
                        from_vector(given.quarters));
}

struct Described {
  GivenField field;
  std::vector<Index> cones;
  Stats stats;
};

FieldOptions to_field_options(const py::dict& given) {
  FieldOptions options;
  OptionReader read(given);
  read("alignment", options.alignment);
  read("edges", options.edges);
  read("boundary", options.boundary);
  read("edge_weight", options.edge_weight);
  read("simplify", options.simplify);
  read("sizing", options.sizing);
  read("cones", options.cones);
  read("loops", options.loops);
  read("max_seconds", options.max_seconds);
  read.end();
  return options;
}

holonomy::AlignedOptions to_aligned_options(const py::dict& given) {
  holonomy::AlignedOptions options;
  OptionReader read(given);
  read("uncuttable", options.engine.uncuttable);
  read("engine_iterations", options.engine.metric.max_iterations);
  read("sizing", options.sizing);
  read_ways(read, options.which, options.boundary);
  read("optimise", options.optimise);
  read("exact", options.exact);
  read("reroute", options.reroute);
  read("max_iterations", options.max_iterations);
  read("max_seconds", options.max_seconds);
  read.end();
  return options;
}

void bind_aligned(py::module_& module) {
  module.def(
      "field_aligned",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::object& given,
         const py::dict& made, const py::dict& options, int threads) {
        std::optional<GivenField> field;
        if (!given.is_none()) {
          const auto parts = given.cast<std::tuple<Array<double>, Array<double>, Array<Index>>>();
          field = to_field(std::get<0>(parts), std::get<1>(parts), std::get<2>(parts));
        }
        return start_job(
            [surface = to_surface(vertices, faces), field = std::move(field),
             made = to_field_options(made),
             options = to_aligned_options(options)](ExecutionContext& context) {
              return in_time(
                  context, options.max_seconds, "The field-aligned map was not reached",
                  "or simplify the field", [&] {
                    field::CrossField own;
                    {
                      const ProgressRange range(context, 0.0, 0.2);
                      own = field ? field::read_field(surface, *field, context)
                                  : field::compute_cross_field(surface, made, context).field;
                    }
                    const ProgressRange range(context, 0.2, 1.0);
                    return holonomy::compute_field_aligned_map(surface, own, options, context);
                  });
            },
            [](certify::Parametrization& map) -> py::object { return to_dict(std::move(map)); },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("field"), py::arg("made"), py::arg("options"),
      py::arg("threads"));
}

// For benchmarks: the cut of the engine "padding" alone, as figures and as lines in space.
struct DescribedCut {
  Stats stats;
  std::vector<Points3> branches;
};

std::vector<Points3> lines_of(const seamless::RefinedPieces& pieces) {
  std::vector<Points3> lines;
  for (const seamless::AdmissibleCut& cut : pieces.cuts) {
    for (const std::vector<HalfedgeId>& branch : cut.branches) {
      Points3& line = lines.emplace_back(static_cast<Eigen::Index>(branch.size()) + 1, 3);
      const auto place = [&](HalfedgeId h) {
        return cut.surface.vertices.row(cut.surface.faces(h / 3, h % 3));
      };
      for (std::size_t i = 0; i < branch.size(); ++i)
        line.row(static_cast<Eigen::Index>(i)) = place(branch[i]);
      line.row(line.rows() - 1) = place(next_corner(branch.back()));
    }
  }
  return lines;
}

void bind_cut(py::module_& module) {
  module.def(
      "field_cut",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& directions,
         const Array<double>& rotation, const Array<Index>& quarters, bool reroute, int threads) {
        return start_job(
            [surface = to_surface(vertices, faces),
             given = to_field(directions, rotation, quarters), reroute](ExecutionContext& context) {
              const field::CrossField own = field::read_field(surface, given, context);
              const mesh::Adjacency adjacency =
                  mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
              const holonomy::NeededTopology needed =
                  holonomy::needed_topology(surface, adjacency, own, true, context);
              seamless::Reroutings done;
              const seamless::RefinedPieces pieces = holonomy::field_cut(
                  surface, adjacency, own, needed.cones, reroute, done, context);
              Stats stats;
              stats["loops"] = static_cast<std::int64_t>(done.loops);
              stats["guided"] = static_cast<std::int64_t>(done.shortest);
              stats["fallback"] = static_cast<std::int64_t>(done.fallback);
              stats["quarters"] = static_cast<std::int64_t>(done.quarters);
              stats["added_vertices"] = static_cast<std::int64_t>(pieces.surface.vertices.rows() -
                                                                  surface.vertices.rows());
              return DescribedCut{std::move(stats), lines_of(pieces)};
            },
            [](const DescribedCut& cut) -> py::object {
              py::list lines;
              for (const Points3& line : cut.branches) lines.append(from_matrix(line));
              return py::make_tuple(to_dict(cut.stats), lines);
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("directions"), py::arg("rotation"),
      py::arg("quarters"), py::arg("reroute"), py::arg("threads"));
}

}  // namespace

void bind_field(py::module_& module) {
  bind_aligned(module);
  bind_cut(module);
  module.def(
      "cross_field",
      [](const Array<double>& vertices, const Array<Index>& faces, const py::dict& options,
         int threads) {
        return start_job(
            [surface = to_surface(vertices, faces),
             options = to_field_options(options)](ExecutionContext& context) {
              field::FoundField found = field::compute_cross_field(surface, options, context);
              return Described{field::describe(surface, found.field), std::move(found.cones),
                               std::move(found.stats)};
            },
            [](const Described& found) -> py::object {
              return py::make_tuple(to_tuple(found.field), to_dict(found.stats));
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("options"), py::arg("threads"));
  module.def(
      "read_field",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& directions,
         const Array<double>& rotation, const Array<Index>& quarters) {
        const mesh::Surface surface = to_surface(vertices, faces);
        const GivenField given = to_field(directions, rotation, quarters);
        GivenField read;
        {
          const py::gil_scoped_release release;
          read = field::describe(surface, field::read_field(surface, given, ExecutionContext()));
        }
        return to_tuple(read);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("directions"), py::arg("rotation"),
      py::arg("quarters"));
  module.def(
      "field_signature",
      [](const Array<double>& vertices, const Array<Index>& faces, const Array<double>& directions,
         const Array<double>& rotation, const Array<Index>& quarters, double max_seconds,
         int threads) {
        return start_job(
            [surface = to_surface(vertices, faces),
             given = to_field(directions, rotation, quarters),
             max_seconds](ExecutionContext& context) {
              return in_time(context, max_seconds, "The signature was not reached",
                             "or ask for that of fewer faces", [&] {
                               return field::read_signature(
                                   surface, field::read_field(surface, given, context), context);
                             });
            },
            [](const field::Signature& signature) -> py::object {
              return py::make_tuple(from_vector(signature.cones), from_loops(signature.loops));
            },
            threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("directions"), py::arg("rotation"),
      py::arg("quarters"), py::arg("max_seconds"), py::arg("threads"));
}

}  // namespace flipfree::python
