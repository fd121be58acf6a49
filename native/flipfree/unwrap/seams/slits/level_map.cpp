#include "flipfree/unwrap/seams/slits/level_map.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/stats.h"
#include "flipfree/distortion/minimize/boundary_grid.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/mesh/decimated/prolong.h"
#include "flipfree/unwrap/chart/overlapping_faces.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/chart/stretch.h"
#include "flipfree/unwrap/seams/slits/search/trial_map.h"

namespace flipfree::unwrap {
namespace {

constexpr double kTolerance = 1e-3;
constexpr int kSteps = 12;
constexpr int kHeldSteps = 4;
// Share of a piece's area by which it may still overlap itself after a cut.
constexpr double kToleratedOverlap = 0.1;

Points2 by_vertex(const mesh::Surface& surface, const Points2& corners) {
  Points2 uv(surface.vertices.rows(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) uv.row(surface.faces.data()[c]) = corners.row(c);
  return uv;
}

class Levels {
 public:
  Levels(const mesh::Surface& chart, const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cut,
         const mesh::EdgeFlags& uncuttable, const SlitOptions& options, ExecutionContext& context)
      : chart_(chart),
        adjacency_(adjacency),
        cut_(cut),
        uncuttable_(uncuttable),
        options_(options),
        context_(context),
        slit_(slit_surface(chart, adjacency, cut)) {}

  LevelMap run() {
    const mesh::Decimated few = mesh::decimate(slit_, kFewTriangles, context_);
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(few.surface.vertices.rows()), few.surface.faces);
    TrialMap coarse(few.surface);
    const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
    coarse.relax(adjacency, none, kTolerance, context_);
    const auto back = [&](const Points2& corners) {
      return mesh::prolong(slit_, few, by_vertex(few.surface, corners), context_);
    };
    Points2 uv = back(coarse.corner_uv());
    if (uv.rows() == 0) return without_levels();
    if (!options_.bijective || !coarse.overlaps_itself(context_)) {
      Points2 free = settle(uv, false);
      if (options_.bijective && overlaps(free)) {
        if (overlaps(uv)) return without_levels();
        free = settle_apart(uv);
      }
      return result(eased(slit_, free, options_.bound, options_.bijective, context_));
    }
    const TrialMap::Apart apart =
        coarse.hold_apart(options_.bound, options_.may_add_cuts, {}, context_);
    if (apart.cut.empty()) {
      const Points2 held = back(apart.corner_uv);
      if (held.rows() == 0 || overlaps(held)) return without_levels();
      return result(eased(slit_, settle_apart(held), options_.bound, true, context_));
    }
    const Points2 held = back(apart.apart);
    if (held.rows() == 0) return without_levels();
    return divided(settle(uv, false), held);
  }

 private:
  // With its boundary held apart: where it is already, if that is good enough.
  Points2 settle_apart(const Points2& uv) {
    distortion::MinimizeOptions options;
    options.max_iterations = kSteps;
    options.tolerance = kTolerance;
    options.fixed = distortion::find_boundary(static_cast<Index>(uv.rows()), slit_.faces).vertices;
    Stats ignored;
    const Points2 inside = distortion::minimize_distortion(slit_, uv, options, context_, ignored);
    return result(inside).stretch.within(options_.bound) ? inside : settle(inside, true);
  }

  Points2 settle(const Points2& uv, bool apart) {
    distortion::MinimizeOptions options;
    options.max_iterations = apart ? kHeldSteps : kSteps;
    options.tolerance = kTolerance;
    options.bijective = options.held_apart = apart;
    Stats ignored;
    return distortion::minimize_distortion(slit_, uv, options, context_, ignored);
  }

  bool overlaps(const Points2& uv) const {
    return distortion::overlaps_itself(
        distortion::find_boundary(static_cast<Index>(uv.rows()), slit_.faces), uv, context_);
  }

  Points2 by_corner(const Points2& uv) const {
    Points2 corners(slit_.faces.size(), 2);
    for (CornerId c = 0; c < corners.rows(); ++c) corners.row(c) = uv.row(slit_.faces.data()[c]);
    return corners;
  }

  LevelMap result(const Points2& uv) const {
    LevelMap map;
    map.slits = {cut_, by_corner(uv), {}};
    map.stretch = stretch_of(chart_, map.slits.corner_uv);
    return map;
  }

  LevelMap divided(const Points2& free, const Points2& apart) {
    LevelMap map = result(free);
    const std::vector<FacePair> pairs = overlapping_faces(slit_.faces, free, context_);
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(slit_.vertices.rows()), slit_.faces);
    mesh::EdgeFlags cut =
        separating_cut(slit_, adjacency, free, pairs, kToleratedOverlap, uncuttable_, context_);
    if (std::find(cut.begin(), cut.end(), 1) == cut.end())
      cut = separating_cut(slit_, adjacency, free, pairs, 0.0, uncuttable_, context_);
    // A map that only touches itself has nothing to be cut between.
    if (std::find(cut.begin(), cut.end(), 1) == cut.end()) return without_levels();
    for (std::size_t h = 0; h < cut.size(); ++h) map.slits.cut[h] |= cut[h];
    map.slits.apart = by_corner(apart);
    return map;
  }

  LevelMap without_levels() {
    TrialMap trial(chart_);
    LevelMap map;
    map.stretch = trial.relax(adjacency_, cut_, kTolerance, context_);
    map.slits = {cut_, trial.corner_uv(), {}};
    if (!options_.bijective || !trial.overlaps_itself(context_)) return map;
    TrialMap::Apart apart =
        trial.hold_apart(options_.bound, options_.may_add_cuts, uncuttable_, context_);
    map.slits.corner_uv = std::move(apart.corner_uv);
    map.stretch = apart.stretch;
    if (apart.cut.empty()) return map;
    for (std::size_t h = 0; h < apart.cut.size(); ++h) map.slits.cut[h] |= apart.cut[h];
    map.slits.apart = std::move(apart.apart);
    return map;
  }

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& cut_;
  const mesh::EdgeFlags& uncuttable_;
  const SlitOptions& options_;
  ExecutionContext& context_;
  mesh::Surface slit_;
};

}  // namespace

LevelMap map_by_levels(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                       const mesh::EdgeFlags& cut, const mesh::EdgeFlags& uncuttable,
                       const SlitOptions& options, ExecutionContext& context) {
  return Levels(chart, adjacency, cut, uncuttable, options, context).run();
}

}  // namespace flipfree::unwrap
