#include "flipfree/seamless/padding/engine/padding.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/in_time.h"
#include "flipfree/base/failure/outcome.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/error_places.h"
#include "flipfree/seamless/padding/geometry/padded_metric.h"

namespace flipfree::seamless {
namespace {

// Steps that bring the padded metric nearer to the surface's own before the first attempt to lay it
// out, which only refines more without them, and before others; and how near is enough.
constexpr int kFirstNearSteps = 4;
constexpr int kNextNearSteps = 12;
constexpr double kPaddedNearEnough = 1.5;

void add_padding_figures(const PaddedMetric& metric, Stats& stats) {
  stats["padding_components"] = static_cast<std::int64_t>(metric.components);
  stats["padding_segments"] = static_cast<std::int64_t>(metric.segments);
  stats["padding_bits"] = static_cast<std::int64_t>(metric.bits);
  stats["padding_scale_range"] = metric.scale_range;
  stats["padding_width"] = metric.largest_width;
  stats["padding_near_steps"] = static_cast<std::int64_t>(metric.steps);
  stats["padding_energy"] = metric.energy;
}

// The metrics of one component after the other, asked for once for each attempt to lay it out.
class PaddedMetricSolver {
 public:
  PaddedMetricSolver(RefinedPieces& pieces, Stats& stats) : pieces_(pieces), stats_(stats) {}

  PennerMetric operator()(const mesh::Surface& component, const std::vector<Index>& cones,
                          const PennerOptions& options, ExecutionContext& context) {
    if (component_ != &component) {
      component_ = &component;
      padded_.reset();
      failure_.reset();
      ++piece_;
    }
    AdmissibleCut& cut = pieces_.cuts[static_cast<std::size_t>(piece_)];
    if (cut.branches.empty()) return compute_penner_metric(component, cones, {}, options, context);
    if (failure_) throw NotConverged(*failure_);
    const bool again = padded_.has_value();
    if (!again) {
      cut.surface = component;  // the same faces, numbered as the vertices are there
      auto padded = attempt([&] { return compute_padded_metric(cut, cones, context); });
      if (!padded) {
        failure_ = padded.error();
        throw NotConverged(*failure_);
      }
      padded_ = std::move(*padded);
    }
    // A layout that failed asks for a metric that is nearer still.
    const int before = padded_->steps;
    come_near(cut, cones, again ? kNextNearSteps : kFirstNearSteps, kPaddedNearEnough, *padded_,
              context);
    add_padding_figures(*padded_, stats_);
    if (again && padded_->steps == before) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The padded metric cannot be brought nearer to the surface's own. Spread "
                          "the cones further apart, or use the engine \"penner\".");
    }
    PennerOptions finishing = options;
    finishing.relaxation = 0;
    finishing.first_attempt = 0;
    return finish_penner_metric(component, cones, padded_->metric, finishing, context);
  }

 private:
  RefinedPieces& pieces_;
  Stats& stats_;
  const mesh::Surface* component_ = nullptr;
  Index piece_ = -1;
  std::optional<PaddedMetric> padded_;
  std::optional<Error> failure_;  // why there is none; the next attempt would end alike
};

// The pairs that are still edges of the refined surface.
IndexPairs edges_left(const IndexPairs& pairs, const mesh::Surface& surface) {
  std::vector<std::pair<VertexId, VertexId>> edges;
  for (HalfedgeId h = 0; pairs.rows() > 0 && h < static_cast<HalfedgeId>(surface.faces.size());
       ++h) {
    edges.push_back(std::minmax({mesh::source(surface.faces, h), mesh::target(surface.faces, h)}));
  }
  std::sort(edges.begin(), edges.end());
  IndexPairs left(pairs.rows(), 2);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < pairs.rows(); ++i) {
    const std::pair<VertexId, VertexId> pair = std::minmax({pairs(i, 0), pairs(i, 1)});
    if (std::binary_search(edges.begin(), edges.end(), pair)) left.row(count++) = pairs.row(i);
  }
  left.conservativeResize(count, 2);
  return left;
}

// Drawing on needles can end in edges of no length, of which no caller knows.
void require_sound(const mesh::Surface& cut, const ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.allow_isolated_vertices = false;
  if (mesh::find_defects(cut, rules, context).empty()) return;
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The cuts of the engine \"padding\" divide triangles that are too thin for "
                      "them. Merge vertices that nearly coincide (Merge by Distance), or take the "
                      "engine \"penner\".");
}

// Where a surface much farther from the origin than it is large is worked on: there, what is drawn
// on it would fall on its vertices. Moving it there is exact.
Eigen::RowVector3d place_of(const mesh::Surface& surface) {
  const Eigen::RowVector3d low = surface.vertices.colwise().minCoeff();
  const Eigen::RowVector3d high = surface.vertices.colwise().maxCoeff();
  constexpr double kFar = 0x1p20;
  const double farthest = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  if (farthest <= kFar * (high - low).maxCoeff()) return Eigen::RowVector3d::Zero();
  return surface.vertices.row(0);
}

// The map of all pieces. What fails names the places of the surface that was given.
PennerMap map_of_pieces(const RefinedPieces& pieces, Eigen::Index given_vertices,
                        const PennerMapOptions& options, ExecutionContext& context) {
  try {
    return compute_penner_map(pieces.surface, pieces.cones, std::nullopt, options, context);
  } catch (const NotConverged&) {
    std::vector<VertexId> own(static_cast<std::size_t>(given_vertices));
    std::iota(own.begin(), own.end(), VertexId{0});
    rethrow_placed(pieces.provenance.face, own);
  }
}

PennerMap padding_map_in_time(const mesh::Surface& given, const std::vector<Index>& cones,
                              const CutMaker& make_cut, const PennerMapOptions& options,
                              ExecutionContext& context) {
  Stopwatch watch;
  Stats stats;
  RefinedPieces pieces;
  const Eigen::RowVector3d place = place_of(given);
  mesh::Surface surface{given.vertices.rowwise() - place, given.faces};
  {
    const ProgressRange range(context, 0.0, 0.1);
    pieces = cut_components(surface, cones, make_cut, context);
    require_sound(pieces.surface, context);
  }
  stats["seconds_cut"] = watch.seconds();
  double cut_range = 0.0, first_range = 0.0;
  for (const AdmissibleCut& cut : pieces.cuts) {
    cut_range = std::max(cut_range, cut.range);
    first_range = std::max(first_range, cut.first_range);
  }
  stats["cut_range"] = cut_range;
  stats["cut_first_range"] = first_range;
  stats["cut_vertices"] =
      static_cast<std::int64_t>(pieces.surface.vertices.rows() - surface.vertices.rows());
  PennerMapOptions own = options;
  own.metric.max_seconds = 0.0;
  own.uncuttable = edges_left(options.uncuttable, pieces.surface);
  PaddedMetricSolver solver(pieces, stats);
  own.solver = [&](const mesh::Surface& component, const std::vector<Index>& own_cones,
                   const std::optional<std::vector<LoopTurn>>&, const PennerOptions& metric,
                   ExecutionContext& inner) { return solver(component, own_cones, metric, inner); };
  const ProgressRange range(context, 0.1, 1.0);
  PennerMap result = map_of_pieces(pieces, given.vertices.rows(), own, context);
  certify::Parametrization& map = result.map;
  result.cones = cones;
  result.loops.clear();  // they are of the refined faces
  name_input_places(surface, pieces, map);
  map.surface.vertices.rowwise() += place;
  map.surface.vertices.topRows(given.vertices.rows()) = given.vertices;
  certify::CertifyRequest request;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] != 4) {
      request.cone_angles.emplace_back(static_cast<VertexId>(v), cones[v] * 0.5 * std::numbers::pi);
    }
  }
  certify::certify_map(map, given, request, context);
  map.stats.merge(stats);
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows() - surface.vertices.rows());
  return result;
}

}  // namespace

PennerMap compute_padding_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                              const CutMaker& make_cut, const PennerMapOptions& options,
                              ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.allow_isolated_vertices = false;
  mesh::validate(surface, rules, context);
  if (cones.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  return in_time(context, options.metric.max_seconds, "The seamless map was not reached",
                 "or spread the curvature over more vertices",
                 [&] { return padding_map_in_time(surface, cones, make_cut, options, context); });
}

}  // namespace flipfree::seamless
