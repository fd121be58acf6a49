#include "flipfree/holonomy/field_aligned.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/in_time.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/measures/flips.h"
#include "flipfree/distortion/alignment/align.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/field/topology/tree_cotree.h"
#include "flipfree/field/topology/turning.h"
#include "flipfree/holonomy/combed.h"
#include "flipfree/holonomy/projected_loops.h"
#include "flipfree/seamless/error_places.h"
#include "flipfree/seamless/request.h"

namespace flipfree::holonomy {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// Of the progress.
constexpr double kEngineShare = 0.5;
constexpr double kAlignmentShare = 0.8;

void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface) {
  if (sizing.empty()) return;
  if (sizing.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "sizing needs one number per vertex.");
  for (std::size_t v = 0; v < sizing.size(); ++v) {
    if (sizing[v] > 0.0 && std::isfinite(sizing[v])) continue;
    throw_invalid(ErrorCode::kBadOption,
                  "sizing at vertex " + std::to_string(v) +
                      " is not a positive number. Give the length in the map of a length 1 there.",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
}

// Of each refined face the geometric mean of its parent's corners.
std::vector<double> size_of_faces(const certify::Parametrization& map, const mesh::Surface& input,
                                  const std::vector<double>& sizing) {
  std::vector<double> size;
  if (sizing.empty()) return size;
  for (const FaceId f : map.parent_face) {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) sum += std::log(sizing[at(input.faces(f, k))]) / 3.0;
    size.push_back(std::exp(sum));
  }
  return size;
}

// Loops of the refined surface that generate its homology, with the field's turns.
seamless::Strips strips_of(const Refined& refined, const mesh::Surface& input,
                           const mesh::Adjacency& adjacency, const field::CrossField& field,
                           const ExecutionContext& context) {
  seamless::Strips strips;
  for (DualLoop& loop : field::tree_cotree(refined.surface, refined.adjacency, context).loops) {
    const Index turns =
        field::turning_number(adjacency, field, projected(refined, input, adjacency, loop));
    strips.emplace_back(std::move(loop), turns);
  }
  return strips;
}

void add_angles(const distortion::CutMap& cut, const std::vector<double>& direction,
                const Points2& uv, Stats& stats) {
  const Points2 off = distortion::angles_off(cut, direction, uv);
  std::vector<std::pair<double, double>> sorted;
  double mean = 0.0, area = 0.0;
  for (Eigen::Index f = 0; f < off.rows(); ++f) {
    sorted.emplace_back(off(f, 0), off(f, 1));
    mean += off(f, 0) * off(f, 1);
    area += off(f, 1);
  }
  std::sort(sorted.begin(), sorted.end());
  double below = 0.0;
  std::size_t i = 0;
  while (i + 1 < sorted.size() && below + sorted[i].second < 0.95 * area)
    below += sorted[i++].second;
  stats["angle_mean"] = mean / area;
  stats["angle_p95"] = sorted[i].first;
}

seamless::PennerMap engine_map(const mesh::Surface& surface, const field::Signature& signature,
                               const AlignedOptions& options, ExecutionContext& context) {
  seamless::PennerMapOptions engine = options.engine;
  engine.metric.max_seconds = 0.0;
  seamless::PennerMap found =
      seamless::compute_penner_map(surface, signature.cones, signature.loops, engine, context);
  if (found.map.certificate.flips64 == 0) return found;
  throw certify::CertificateFailed("The field-aligned map", certify::in_input_faces(found.map));
}

certify::Parametrization map_in_time(const mesh::Surface& surface, const field::CrossField& field,
                                     const AlignedOptions& options, ExecutionContext& context) {
  seamless::check_surface(surface, context);
  check_sizing(options.sizing, surface);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const field::Signature signature =
      field::signature_of(surface, adjacency, field::measure_frames(surface), field, context);
  seamless::check_request(surface, signature.cones, context);
  seamless::refuse_boundary(surface);
  seamless::PennerMap found;
  {
    const ProgressRange range(context, 0.0, kEngineShare);
    found = engine_map(surface, signature, options, context);
  }
  certify::Parametrization& map = found.map;
  const mesh::Adjacency own =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const Refined refined{map.surface, own, map.parent_face};
  const mesh::EdgeFlags cuts = mesh::flag_edges(map.surface.faces, own, map.cut_edges);
  const seamless::Strips strips = strips_of(refined, surface, adjacency, field, context);
  const std::vector<double> direction = combed_directions(refined, cuts, surface, adjacency, field);
  Points2 turned = map.uv;
  turn_towards(refined, direction, turned);
  // Rounding may fold a sliver; the map is then aligned from where it lies.
  if (certify::flipped_faces(turned).empty()) map.uv = std::move(turned);
  const distortion::CutMap cut = distortion::cut_map(map.surface, own, cuts, map.uv);
  Stats stats;
  add_angles(cut, direction, cut.uv, stats);
  stats["angle_mean_engine"] = stats["angle_mean"];
  if (options.optimise) {
    const ProgressRange range(context, kEngineShare, kAlignmentShare);
    distortion::AlignOptions align;
    align.direction = direction;
    align.size = size_of_faces(map, surface, options.sizing);
    align.max_iterations = options.max_iterations;
    try {
      map.uv = distortion::corners_of(cut, distortion::align(cut, align, context, stats));
    } catch (...) {
      seamless::rethrow_placed(map.parent_face, {});  // it counts faces of the refined map
    }
  }
  const ProgressRange range(context, kAlignmentShare, 1.0);
  seamless::SeamlessOptions finish;
  finish.optimise = false;
  finish.exact = options.exact;
  certify::Parametrization result =
      seamless::finish_map(std::move(found), surface, strips, finish, context);
  Points2 uv(cut.uv.rows(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(result.uv.rows()); ++c)
    uv.row(cut.surface.faces(c / 3, c % 3)) = result.uv.row(c);
  add_angles(cut, direction, uv, stats);
  for (auto& [name, value] : stats) result.stats[name] = std::move(value);
  result.stats["loops_checked"] = static_cast<std::int64_t>(strips.size());
  return result;
}

}  // namespace

certify::Parametrization compute_field_aligned_map(const mesh::Surface& surface,
                                                   const field::CrossField& field,
                                                   const AlignedOptions& options,
                                                   ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The field-aligned map was not reached",
                 "or simplify the field",
                 [&] { return map_in_time(surface, field, options, context); });
}

}  // namespace flipfree::holonomy
