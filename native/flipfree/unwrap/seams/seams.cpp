#include "flipfree/unwrap/seams/seams.h"

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "flipfree/unwrap/islands/normalised.h"
#include "flipfree/unwrap/seams/auto_islands.h"

namespace flipfree::unwrap {
namespace {

IndexPairs find_on_clean(const mesh::Surface& surface, const UnwrapOptions& options,
                         ExecutionContext& context) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const mesh::EdgeFlags seams = mesh::flag_edges(surface.faces, adjacency, options.cuts);
  const mesh::EdgeFlags uncuttable =
      options.uncuttable.rows() == 0
          ? mesh::EdgeFlags{}
          : mesh::flag_edges(surface.faces, adjacency, options.uncuttable);
  const mesh::Surface working{normalised(surface.vertices, surface.faces), surface.faces};
  UnwrapOptions own = options;
  own.seams.edges_only = true;
  Stats ignored;
  const mesh::EdgeFlags cut = find_islands(working, surface.vertices, adjacency, seams, uncuttable,
                                           own, false, context, ignored)
                                  .islands.cut;
  return mesh::flagged_edges(surface.faces, adjacency, cut);
}

IndexPairs find_on_separated(const mesh::Surface& surface, const UnwrapOptions& options,
                             ExecutionContext& context) {
  mesh::SeparateOptions separating;
  separating.seams = &options.cuts;
  separating.diagonals = &options.uncuttable;
  if (!options.material.empty()) separating.material = &options.material;
  if (!options.polygon.empty()) separating.polygon = &options.polygon;
  const certify::SeparatedMap separated(surface, separating, context);
  UnwrapOptions own = options;
  own.cuts = separated.edges(options.cuts);
  own.uncuttable = separated.edges(options.uncuttable);
  own.seams = weights_on(separated, options.seams);
  return separated.edges_of_input(
      separated.solve([&] { return find_on_clean(separated.surface(), own, context); }));
}

}  // namespace

IndexPairs find_seams(const mesh::Surface& surface, const UnwrapOptions& options,
                      ExecutionContext& context) try {
  const TimeLimit limit(context, limit_of(options.max_seconds));
  context.report("checking the mesh", 0.0);
  const IndexPairs seams = certify::is_clean(surface, context)
                               ? find_on_clean(surface, options, context)
                               : find_on_separated(surface, options, context);
  const Untimed finishing(context);
  context.report("done", 1.0);
  return seams;
} catch (const TimeIsOver&) {
  if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
  throw_out_of_time("No seams were found", options.max_seconds, "or find them part by part");
}

}  // namespace flipfree::unwrap
