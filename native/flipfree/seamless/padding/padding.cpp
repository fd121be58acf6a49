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
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/padding/padded_metric.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

namespace {

// Weights of vertex v of the refined surface for the corners of a face of the input that it lies
// in.
Vector3 weights_in(const mesh::Surface& input, const RefinedPieces& pieces, VertexId v,
                   FaceId face) {
  const mesh::SurfacePoint& point = pieces.provenance.vertex[at(v)];
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

// Adds the cut of a component, given as a chart of the input.
void add_piece(const mesh::Chart& chart, const mesh::CutMesh& open, AdmissibleCut cut,
               RefinedPieces& out) {
  const auto own_count = static_cast<Index>(chart.vertices.size());
  std::vector<VertexId> name;
  for (const VertexId v : chart.vertices) name.push_back(open.vertex_origin[at(v)]);
  Points3& vertices = out.surface.vertices;
  auto next = static_cast<VertexId>(vertices.rows());
  vertices.conservativeResize(vertices.rows() + cut.surface.vertices.rows() - own_count, 3);
  for (VertexId v = own_count; v < static_cast<VertexId>(cut.surface.vertices.rows()); ++v) {
    mesh::SurfacePoint point = cut.provenance.vertex[at(v)];
    point.face = chart.faces[at(point.face)];
    out.provenance.vertex.push_back(point);
    out.cones.push_back(4);
    vertices.row(next) = cut.surface.vertices.row(v);
    name.push_back(next++);
  }
  Triangles& faces = out.surface.faces;
  const Eigen::Index first = faces.rows();
  faces.conservativeResize(first + cut.surface.faces.rows(), 3);
  for (Eigen::Index f = 0; f < cut.surface.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(first + f, k) = name[at(cut.surface.faces(f, k))];
    out.provenance.face.push_back(
        chart.faces[at(cut.provenance.face[static_cast<std::size_t>(f)])]);
  }
  out.cuts.push_back(std::move(cut));
}

}  // namespace

RefinedPieces cut_components(const mesh::Surface& input, const std::vector<Index>& cones,
                             const CutMaker& make_cut, ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(input.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, input.faces);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const mesh::CutMesh open = mesh::cut_along(input.faces, adjacency, none);
  const std::vector<mesh::Chart> charts = mesh::split_into_charts(input.vertices, open);
  RefinedPieces out;
  out.surface.vertices = input.vertices;
  out.cones = cones;
  out.provenance.vertex.resize(at(vertex_count));
  for (CornerId c = 0; c < 3 * static_cast<Index>(input.faces.rows()); ++c)
    out.provenance.vertex[at(input.faces(c / 3, c % 3))] = {c / 3, Vector3::Unit(c % 3)};
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto count = static_cast<double>(charts.size());
    const ProgressRange range(context, static_cast<double>(i) / count,
                              static_cast<double>(i + 1) / count);
    std::vector<Index> own;
    for (const VertexId v : charts[i].vertices) own.push_back(cones[at(open.vertex_origin[at(v)])]);
    add_piece(charts[i], open, make_cut(charts[i].surface, own, charts[i].faces, context), out);
  }
  return out;
}

void name_input_places(const mesh::Surface& input, const RefinedPieces& pieces,
                       certify::Parametrization& map) {
  for (std::size_t v = 0; v < map.vertex_parent.size(); ++v) {
    const FaceId fine = map.vertex_parent[v];
    const FaceId face = pieces.provenance.face[at(fine)];
    Vector3 weight = Vector3::Zero();
    for (Index k = 0; k < 3; ++k) {
      const double share = map.vertex_barycentric(static_cast<Eigen::Index>(v), k);
      if (share != 0.0)
        weight += share * weights_in(input, pieces, pieces.surface.faces(fine, k), face);
    }
    map.vertex_parent[v] = face;
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = weight;
  }
  for (FaceId& parent : map.parent_face) parent = pieces.provenance.face[at(parent)];
}

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
