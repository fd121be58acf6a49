#include "flipfree/seamless/padding/padding.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/padding/padded_metric.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

namespace {

// Weights of vertex v of the refined surface for the corners of a face of the input that it lies
// in.
Vector3 weights_in(const mesh::Surface& input, const mesh::Provenance& provenance, VertexId v,
                   FaceId face) {
  const mesh::SurfacePoint& point = provenance.vertex[at(v)];
  if (point.face == face) return point.weight;
  Vector3 weight = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (point.weight[k] == 0.0) continue;
    bool found = false;
    for (int j = 0; j < 3; ++j) {
      if (input.faces(face, j) != input.faces(point.face, k)) continue;
      weight[j] = point.weight[k];
      found = true;
    }
    if (!found) {
      throw InternalError("refined pieces: vertex " + std::to_string(v) + " lies outside face " +
                          std::to_string(face));
    }
  }
  return weight;
}

}  // namespace

void name_input_places(const mesh::Surface& input, const mesh::Provenance& provenance,
                       const Triangles& refined, certify::Parametrization& map) {
  for (std::size_t v = 0; v < map.vertex_parent.size(); ++v) {
    const FaceId fine = map.vertex_parent[v];
    const FaceId face = provenance.face[at(fine)];
    Vector3 weight = Vector3::Zero();
    for (Index k = 0; k < 3; ++k) {
      const double share = map.vertex_barycentric(static_cast<Eigen::Index>(v), k);
      if (share != 0.0) weight += share * weights_in(input, provenance, refined(fine, k), face);
    }
    map.vertex_parent[v] = face;
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = weight;
  }
  for (FaceId& parent : map.parent_face) parent = provenance.face[at(parent)];
}

namespace {

// Steps that bring the padded metric nearer to the surface's own before the first attempt to lay it
// out, which only refines more without them, and more of them before each other one.
constexpr int kFirstNearSteps = 4;
constexpr int kMoreNearSteps = 12;

// The metrics of one component, asked for once for each attempt to lay it out.
class PaddedMetricSolver {
 public:
  PaddedMetricSolver(const AdmissibleCut& cut, Stats& stats) : cut_(cut), stats_(stats) {}

  PennerMetric solve(const std::vector<Index>& cones, const PennerOptions& options,
                     ExecutionContext& context) {
    if (cut_.branches.empty())
      return compute_penner_metric(cut_.surface, cones, {}, options, context);
    if (failure_) throw NotConverged(*failure_);
    if (!padded_) pad(cones, context);
    PennerOptions finishing = options;
    finishing.first_attempt = 0;
    finishing.relaxation = near_steps_;
    near_steps_ += kMoreNearSteps;
    PennerMetric metric =
        finish_penner_metric(cut_.surface, cones, padded_->metric, finishing, context);
    stats_["padding_near_steps"] = static_cast<std::int64_t>(metric.relaxed);
    // A layout that failed asks for a metric that is nearer still.
    if (metric.relaxed <= std::exchange(reached_, metric.relaxed)) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The padded metric cannot be brought nearer to the surface's own. Spread "
                          "the cones further apart, or use the engine \"penner\".");
    }
    return metric;
  }

 private:
  void pad(const std::vector<Index>& cones, ExecutionContext& context) {
    auto padded = attempt([&] { return compute_padded_metric(cut_, cones, context); });
    if (!padded) {
      failure_ = padded.error();
      throw NotConverged(*failure_);
    }
    padded_ = std::move(*padded);
    stats_["padding_components"] = static_cast<std::int64_t>(padded_->components);
    stats_["padding_width"] = padded_->largest_width;
  }

  const AdmissibleCut& cut_;
  Stats& stats_;
  std::optional<PaddedMetric> padded_;
  std::optional<Error> failure_;  // why there is none; the next attempt would end alike
  int near_steps_ = kFirstNearSteps;
  int reached_ = -1;
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

// The map of one component.
PennerMap map_padded(const mesh::Surface& given, const std::vector<Index>& cones,
                     const CutMaker& make_cut, const PennerMapOptions& options,
                     const std::vector<FaceId>& faces, ExecutionContext& context) {
  const Stopwatch watch;
  Stats stats;
  AdmissibleCut cut;
  const Eigen::RowVector3d place = place_of(given);
  const mesh::Surface surface{given.vertices.rowwise() - place, given.faces};
  {
    const ProgressRange range(context, 0.0, 0.1);
    cut = make_cut(surface, cones, faces, context);
    require_sound(cut.surface, context);
  }
  const Eigen::Index own_count = surface.vertices.rows();
  stats["seconds_cut"] = watch.seconds();
  stats["cut_vertices"] = static_cast<std::int64_t>(cut.surface.vertices.rows() - own_count);
  std::vector<Index> all = cones;
  all.resize(static_cast<std::size_t>(cut.surface.vertices.rows()), 4);
  PaddedMetricSolver solver(cut, stats);
  PennerMapOptions own = options;
  own.uncuttable = edges_left(options.uncuttable, cut.surface);
  own.solver = [&](const mesh::Surface&, const std::vector<Index>& refined,
                   const std::optional<std::vector<LoopTurn>>&, const PennerOptions& metric,
                   ExecutionContext& inner) { return solver.solve(refined, metric, inner); };
  PennerMap result;
  try {
    const ProgressRange range(context, 0.1, 1.0);
    result = map_component(cut.surface, all, std::nullopt, own, context);
  } catch (const NotConverged&) {
    std::vector<VertexId> vertices(static_cast<std::size_t>(own_count));
    std::iota(vertices.begin(), vertices.end(), VertexId{0});
    rethrow_placed(cut.provenance.face, vertices);
  }
  certify::Parametrization& map = result.map;
  result.cones = cones;
  result.loops.clear();  // they are of the refined faces
  name_input_places(surface, cut.provenance, cut.surface.faces, map);
  map.surface.vertices.rowwise() += place;
  map.surface.vertices.topRows(own_count) = given.vertices;
  certify::CertifyRequest request;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] != 4) {
      request.cone_angles.emplace_back(static_cast<VertexId>(v), cones[v] * 0.5 * std::numbers::pi);
    }
  }
  certify::certify_map(map, given, request, context);
  map.stats.merge(stats);
  map.stats["added_vertices"] = static_cast<std::int64_t>(map.surface.vertices.rows() - own_count);
  return result;
}

}  // namespace

PennerMap compute_padding_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                              const CutMaker& make_cut, const PennerMapOptions& options,
                              ExecutionContext& context) {
  const ComponentMapper map_one = [&](const mesh::Surface& component, const std::vector<Index>& own,
                                      const std::optional<std::vector<LoopTurn>>&,
                                      const PennerMapOptions& own_options,
                                      const std::vector<FaceId>& faces, ExecutionContext& inner) {
    return map_padded(component, own, make_cut, own_options, faces, inner);
  };
  return map_each_component(surface, cones, std::nullopt, options, map_one, context);
}

}  // namespace flipfree::seamless
