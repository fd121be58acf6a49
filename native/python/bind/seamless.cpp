// Seamless maps, cross fields, and maps that follow them.
#include <algorithm>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/field/compute.h"
#include "flipfree/holonomy/field_aligned.h"
#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/request.h"
#include "job.h"

namespace flipfree::python {
namespace {

using field::GivenField;

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
    options.engine.max_iterations = options.max_iterations;
  FLIPFREE_READ(read, options, optimise, exact, max_seconds);
  return options;
}

field::FieldOptions read_field(OptionReader& read) {
  field::FieldOptions options;
  FLIPFREE_READ(read, options, alignment, edges, let_go, boundary, edge_weight, simplify, sizing,
                cones, loops, max_seconds);
  return options;
}

holonomy::AlignedOptions read_aligned(OptionReader& read) {
  holonomy::AlignedOptions options;
  read_ways(read, options.which, options.boundary);
  read("uncuttable", options.engine.uncuttable);
  read("iterations", options.engine.max_iterations);
  FLIPFREE_READ(read, options, sizing, optimise, features, exact, reroute, max_seconds);
  return options;
}

certify::Parametrization follow(const mesh::Surface& surface,
                                const std::optional<GivenField>& given,
                                const field::FieldOptions& made,
                                const holonomy::AlignedOptions& options,
                                ExecutionContext& context) {
  const auto find = [&] {
    if (!given) return holonomy::compute_map_along_features(surface, made, options, context);
    return holonomy::compute_field_aligned_map(surface, field::read_field(surface, *given, context),
                                               options, context);
  };
  return in_time(context, options.max_seconds, "The field-aligned map was not reached",
                 "or simplify the field", find);
}

void require_closed(const mesh::Adjacency& adjacency) {
  for (HalfedgeId h = 0; static_cast<std::size_t>(h) < adjacency.opposite.size(); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    throw_invalid(ErrorCode::kBadOption,
                  "The surface is open at face " + face_id(h / 3) +
                      ", and admissible cuts are of closed ones. Close its holes.",
                  ElementKind::kFace, {h / 3});
  }
}

using Sectors = std::vector<std::pair<VertexId, FaceId>>;

// (refined surface, its parent faces, parents and weights of its vertices, branches as vertices,
// (vertex, first face) of each right angle at a node and of each flat sector there).
using FoundCut = std::tuple<Points3, Triangles, std::vector<FaceId>, std::vector<FaceId>, Points3,
                            std::vector<std::vector<VertexId>>, Sectors, Sectors, Stats>;

FoundCut described(holonomy::RefinedPieces&& pieces, Stats stats) {
  const auto& [face, vertex] = pieces.provenance;
  Points3 weights(static_cast<Eigen::Index>(vertex.size()), 3);
  std::vector<FaceId> parents;
  for (const mesh::SurfacePoint& point : vertex) {
    weights.row(static_cast<Eigen::Index>(parents.size())) = point.weight.transpose();
    parents.push_back(point.face);
  }
  const Triangles& faces = pieces.surface.faces;
  std::vector<std::vector<VertexId>> branches;
  Sectors corners, flat;
  FaceId first = 0;
  for (const seamless::AdmissibleCut& cut : pieces.cuts) {
    const auto placed = [&](HalfedgeId h) {
      return std::pair{mesh::source(faces, h + 3 * first), h / 3 + first};
    };
    const mesh::Adjacency& adjacency = cut.surface.adjacency();
    for (const HalfedgeId h : cut.flat_sectors) flat.push_back(placed(h));
    for (const std::vector<HalfedgeId>& branch : cut.branches) {
      std::vector<VertexId>& path = branches.emplace_back();
      for (const HalfedgeId h : branch) path.push_back(placed(h).first);
      path.push_back(mesh::target(faces, branch.back() + 3 * first));
      // Both ends are nodes, at each of which the sector to the left of the branch begins.
      const HalfedgeId back = adjacency.opposite[static_cast<std::size_t>(branch.back())];
      for (const HalfedgeId h : {branch.front(), back}) {
        if (std::ranges::find(cut.flat_sectors, h) == cut.flat_sectors.end())
          corners.push_back(placed(h));
      }
    }
    first += static_cast<FaceId>(cut.surface.faces.rows());
  }
  return {std::move(pieces.surface.vertices),
          pieces.surface.faces.triangles(),
          face,
          std::move(parents),
          std::move(weights),
          std::move(branches),
          std::move(corners),
          std::move(flat),
          std::move(stats)};
}

// With the cones given, or with those of a field and turning as it does (thesis 5.2.1, 6.5).
FoundCut admissible_cut(const mesh::Surface& surface,
                        const std::optional<std::vector<Index>>& cones,
                        const std::optional<GivenField>& given, bool reroute,
                        ExecutionContext& context) {
  mesh::validate(surface, {}, context);
  require_closed(surface.adjacency());
  std::optional<field::CrossField> own;
  if (given) {
    own = field::read_field(surface, *given, context);
  } else {
    seamless::check_request(surface, *cones, context);
  }
  const std::vector<Index> wanted =
      own ? holonomy::needed_topology(surface, *own, true, 0.0, context).cones : *cones;
  seamless::Reroutings done;
  holonomy::RefinedPieces pieces =
      holonomy::field_cut(surface, own && reroute ? &*own : nullptr, wanted, done, context);
  if (!own) return described(std::move(pieces), {});
  return described(std::move(pieces), {{"loops", static_cast<std::int64_t>(done.loops)},
                                       {"guided", static_cast<std::int64_t>(done.shortest)},
                                       {"fallback", static_cast<std::int64_t>(done.fallback)},
                                       {"quarters", static_cast<std::int64_t>(done.quarters)}});
}

}  // namespace

void bind_seamless(py::module_& module) {
  using Cones = std::optional<std::vector<Index>>;
  const auto cones = option<Cones>("cones");
  const auto given_field = option<std::optional<GivenField>>("field");
  const auto seamless_map = [](const auto& surface, const Cones& given, const auto& options,
                               auto& context) {
    return given ? seamless::compute_seamless_map(surface, *given, options, context)
                 : seamless::map_with_suggested_cones(surface, options, context);
  };
  def_job(module, "seamless", prepared(seamless_map, cones, read_seamless));
  const auto read_made = [](OptionReader& read) {
    OptionReader made(read.value<py::dict>("made"));
    const field::FieldOptions options = read_field(made);
    made.end();
    return options;
  };
  def_job(module, "field_aligned", prepared(&follow, given_field, read_made, read_aligned));
  def_job(module, "admissible_cut", "The cut was not found", "or ask for fewer cones",
          prepared(&admissible_cut, cones, given_field, option<bool>("reroute")));
  const auto make_field = [](const auto& surface, const auto& options, auto& context) {
    field::FoundField found = field::compute_cross_field(surface, options, context);
    return std::tuple(field::describe(surface, found.field), std::move(found.stats));
  };
  def_job(module, "cross_field", prepared(make_field, read_field));
  const auto signature_of = [](const auto& surface, const GivenField& given, auto& context) {
    const field::Signature found =
        field::signature_of(surface, field::read_field(surface, given, context), context);
    return std::tuple(found.cones, found.loops);
  };
  def_job(module, "field_signature", "The signature was not reached",
          "or ask for that of fewer faces", prepared(signature_of, option<GivenField>("field")));
  module.def(
      "read_field",
      [](const Points3& vertices, const Triangles& faces, const GivenField& given) {
        const mesh::Surface surface{vertices, faces};
        return field::describe(surface, field::read_field(surface, given, ExecutionContext()));
      },
      py::call_guard<py::gil_scoped_release>());
}

}  // namespace flipfree::python
