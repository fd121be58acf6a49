// Seamless maps, cross fields, and maps that follow them.
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/field/compute.h"
#include "flipfree/holonomy/engines.h"
#include "flipfree/holonomy/field_aligned.h"
#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "job.h"

namespace flipfree::python {
namespace {

using field::GivenField;

// (directions, rotation, quarters), each of which may be empty.
using FieldArrays = std::tuple<Points3, std::vector<double>, std::vector<Index>>;

GivenField to_field(const FieldArrays& arrays) {
  const auto& [directions, rotation, quarters] = arrays;
  return {directions, rotation, quarters};
}

FieldArrays to_arrays(const GivenField& given) {
  return {given.directions, given.rotation, given.quarters};
}

void read_ways(OptionReader& read, seamless::Engine& engine, seamless::Boundary& boundary) {
  using seamless::Boundary;
  using seamless::Engine;
  read.choice(
      "engine", engine,
      {{"auto", Engine::kAuto}, {"penner", Engine::kPenner}, {"padding", Engine::kPadding}});
  read.choice("boundary", boundary,
              {{"aligned", Boundary::kAligned},
               {"aligned_or_free", Boundary::kAlignedOrFree},
               {"free", Boundary::kFree}});
}

seamless::SeamlessOptions read_seamless(OptionReader& read) {
  seamless::SeamlessOptions options;
  read_ways(read, options.which, options.boundary);
  read("uncuttable", options.engine.uncuttable);
  if (read("max_iterations", options.max_iterations))
    options.engine.metric.max_iterations = options.max_iterations;
  read("optimise", options.optimise);
  read("exact", options.exact);
  read("max_seconds", options.max_seconds);
  return options;
}

field::FieldOptions read_field(OptionReader& read) {
  field::FieldOptions options;
  read("alignment", options.alignment);
  read("edges", options.edges);
  read("boundary", options.boundary);
  read("edge_weight", options.edge_weight);
  read("simplify", options.simplify);
  read("sizing", options.sizing);
  read("cones", options.cones);
  read("loops", options.loops);
  read("max_seconds", options.max_seconds);
  return options;
}

holonomy::AlignedOptions read_aligned(OptionReader& read) {
  holonomy::AlignedOptions options;
  read_ways(read, options.which, options.boundary);
  read("uncuttable", options.engine.uncuttable);
  read("iterations", options.engine.metric.max_iterations);
  read("sizing", options.sizing);
  read("optimise", options.optimise);
  read("exact", options.exact);
  read("reroute", options.reroute);  // for benchmarks
  read("max_seconds", options.max_seconds);
  return options;
}

certify::Parametrization follow(const mesh::Surface& surface,
                                const std::optional<FieldArrays>& given,
                                const field::FieldOptions& made,
                                const holonomy::AlignedOptions& options,
                                ExecutionContext& context) {
  const auto find = [&] {
    field::CrossField own;
    {
      const ProgressRange range(context, 0.0, 0.2);
      own = given ? field::read_field(surface, to_field(*given), context)
                  : field::compute_cross_field(surface, made, context).field;
    }
    const ProgressRange range(context, 0.2, 1.0);
    return holonomy::compute_field_aligned_map(surface, own, options, context);
  };
  return in_time(context, options.max_seconds, "The field-aligned map was not reached",
                 "or simplify the field", find);
}

double length_of(const seamless::AdmissibleCut& cut) {
  double sum = 0.0;
  for (const std::vector<HalfedgeId>& branch : cut.branches) {
    for (const HalfedgeId h : branch)
      sum += (cut.surface.vertices.row(mesh::target(cut.surface.faces, h)) -
              cut.surface.vertices.row(mesh::source(cut.surface.faces, h)))
                 .norm();
  }
  return sum;
}

// What the cut of the engine "padding" is like (thesis table 6.1); for benchmarks.
Stats described_cut(const mesh::Surface& surface, const GivenField& given, bool reroute,
                    ExecutionContext& context) {
  const field::CrossField own = field::read_field(surface, given, context);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const std::vector<Index> cones =
      holonomy::needed_topology(surface, adjacency, own, true, context).cones;
  seamless::Reroutings done;
  double length = 0.0;
  Eigen::Index added = -surface.vertices.rows();
  for (const seamless::AdmissibleCut& cut :
       holonomy::field_cuts(surface, adjacency, own, cones, reroute, done, context)) {
    length += length_of(cut);
    added += cut.surface.vertices.rows();
  }
  return {{"loops", static_cast<std::int64_t>(done.loops)},
          {"guided", static_cast<std::int64_t>(done.shortest)},
          {"fallback", static_cast<std::int64_t>(done.fallback)},
          {"quarters", static_cast<std::int64_t>(done.quarters)},
          {"length", length},
          {"added_vertices", static_cast<std::int64_t>(added)}};
}

}  // namespace

void bind_seamless(py::module_& module) {
  def_job(module, "seamless", [](OptionReader& read) {
    return
        [cones = read.value<std::optional<std::vector<Index>>>("cones"),
         options = read_seamless(read)](const mesh::Surface& surface, ExecutionContext& context) {
          return cones ? seamless::compute_seamless_map(surface, *cones, options, context)
                       : seamless::map_with_suggested_cones(surface, options, context);
        };
  });
  def_job(module, "field_aligned", [](OptionReader& read) {
    OptionReader read_made(read.value<py::dict>("made"));
    const field::FieldOptions made = read_field(read_made);
    read_made.end();
    return [given = read.value<std::optional<FieldArrays>>("field"), made,
            options = read_aligned(read)](const mesh::Surface& surface, ExecutionContext& context) {
      return follow(surface, given, made, options, context);
    };
  });
  def_job(module, "field_cut", [](OptionReader& read) {
    return
        [given = to_field(read.value<FieldArrays>("field")), reroute = read.value<bool>("reroute")](
            const mesh::Surface& surface, ExecutionContext& context) {
          return described_cut(surface, given, reroute, context);
        };
  });
  def_job(module, "cross_field", [](OptionReader& read) {
    return [options = read_field(read)](const mesh::Surface& surface, ExecutionContext& context) {
      field::FoundField found = field::compute_cross_field(surface, options, context);
      return std::tuple(to_arrays(field::describe(surface, found.field)), std::move(found.stats));
    };
  });
  def_job(module, "field_signature", [](OptionReader& read) {
    return [given = to_field(read.value<FieldArrays>("field")),
            max_seconds = read.value<double>("max_seconds")](const mesh::Surface& surface,
                                                             ExecutionContext& context) {
      const field::Signature found =
          in_time(context, max_seconds, "The signature was not reached",
                  "or ask for that of fewer faces", [&] {
                    return field::read_signature(
                        surface, field::read_field(surface, given, context), context);
                  });
      return std::tuple(found.cones, found.loops);
    };
  });
  module.def(
      "read_field",
      [](const Points3& vertices, const Triangles& faces, const FieldArrays& arrays) {
        const mesh::Surface surface{vertices, faces};
        return to_arrays(field::describe(
            surface, field::read_field(surface, to_field(arrays), ExecutionContext())));
      },
      py::call_guard<py::gil_scoped_release>());
}

}  // namespace flipfree::python
