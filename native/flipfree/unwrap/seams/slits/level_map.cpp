#include "flipfree/unwrap/seams/slits/level_map.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/unwrap/chart/stretch.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/seams/search/trial_map.h"
#include "flipfree/unwrap/seams/slits/carried_cut.h"
#include "flipfree/unwrap/seams/slits/drawn_out.h"

namespace flipfree::unwrap {
namespace {

// Newton steps of the whole map: one where it keeps the bound already.
constexpr int kWholeSteps = 12;
constexpr int kStepsBetween = 6;
constexpr int kHeldLevelSteps = 4;
// Triangles of a level over those of the next, at most.
constexpr double kRatio = 10.0;
// Triangles of a piece from which on it has levels.
constexpr Eigen::Index kWorthLevels = 2 * kFewTriangles;

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
    decimate();
    const mesh::Surface& few = levels_.back().surface;
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(few.vertices.rows()), few.faces);
    TrialMap coarse(few);
    const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
    coarse.relax(adjacency, none, kTrialTolerance, context_);
    if (!options_.bijective || !coarse.overlaps_itself(context_)) {
      Points2 free = back(coarse.corner_uv(), false);
      if (free.rows() == 0) return without_levels();
      free = settle(slit_, free, steps_for(slit_, free));
      if (options_.bijective && overlaps(slit_, free)) return held(coarse.corner_uv());
      return result(eased(slit_, free, options_.bound, options_.bijective, context_));
    }
    const TrialMap::Apart apart =
        coarse.hold_apart(options_.bound, options_.may_add_cuts, {}, context_);
    if (apart.cut.empty()) return held(apart.corner_uv);
    const mesh::Adjacency of_slit =
        mesh::build_adjacency(static_cast<Index>(slit_.vertices.rows()), slit_.faces);
    const mesh::EdgeFlags division = carried_cut(
        slit_, of_slit, levels_, divided_on(few, adjacency, apart.cut), uncuttable_, context_);
    return division.empty() ? without_levels() : divided(of_slit, division);
  }

 private:
  // In steps of about the same ratio, down to the few.
  void decimate() {
    const auto whole = static_cast<double>(slit_.faces.rows());
    const double ratio = std::max(whole / kFewTriangles, 1.0);
    const int steps = std::max(static_cast<int>(std::ceil(std::log(ratio) / std::log(kRatio))), 1);
    for (int step = 1; step <= steps; ++step) {
      const double left = whole * std::pow(ratio, -static_cast<double>(step) / steps);
      levels_.push_back(mesh::decimate(step == 1 ? slit_ : levels_.back().surface,
                                       static_cast<Index>(std::lround(left)), context_));
    }
  }

  // A map of the few on the slit surface; settled on the way, but not at its end. Empty if it does
  // not get there. apart: it does not lie on itself, nor does what comes of it.
  Points2 back(const Points2& corners, bool apart) {
    Points2 uv = by_vertex(levels_.back().surface, corners);
    for (std::size_t i = levels_.size(); i-- > 0 && uv.rows() > 0;) {
      const mesh::Surface& whole = i == 0 ? slit_ : levels_[i - 1].surface;
      uv = mesh::prolong(whole, levels_[i], uv, apart, context_);
      if (uv.rows() == 0) break;
      Points2 relaxed = relaxed_where_drawn_out(whole, uv, false, context_);
      if (apart && overlaps(whole, relaxed)) {
        relaxed = relaxed_where_drawn_out(whole, uv, true, context_);
        if (overlaps(whole, relaxed)) return {};
      }
      uv = std::move(relaxed);
      if (i > 0) uv = apart ? settle_apart(whole, uv) : settle(whole, uv, kStepsBetween);
    }
    return uv;
  }

  // From a map of the few that is not on itself.
  LevelMap held(const Points2& corners) {
    const Points2 uv = back(corners, true);
    if (uv.rows() == 0) return without_levels();
    return result(eased(slit_, settle_apart(slit_, uv), options_.bound, true, context_));
  }

  // With its boundary held apart: where it is already, if that is good enough.
  Points2 settle_apart(const mesh::Surface& surface, const Points2& uv) {
    const Points2 inside = settle_inside(surface, uv);
    if (stretch_of(surface, by_corner(surface.faces, inside)).within(options_.bound)) return inside;
    distortion::MinimizeOptions options;
    options.max_iterations = kHeldLevelSteps;
    options.tolerance = kTrialTolerance;
    options.bijective = options.held_apart = true;
    Stats ignored;
    return distortion::minimize_distortion(surface, inside, options, context_, ignored);
  }

  Points2 settle_inside(const mesh::Surface& surface, const Points2& uv) {
    distortion::MinimizeOptions options;
    options.max_iterations = steps_for(surface, uv);
    options.tolerance = kTrialTolerance;
    options.fixed =
        distortion::find_boundary(static_cast<Index>(uv.rows()), surface.faces).vertices;
    Stats ignored;
    return distortion::minimize_distortion(surface, uv, options, context_, ignored);
  }

  int steps_for(const mesh::Surface& surface, const Points2& uv) const {
    return stretch_of(surface, by_corner(surface.faces, uv)).within(options_.bound) ? 1
                                                                                    : kWholeSteps;
  }

  Points2 settle(const mesh::Surface& surface, const Points2& uv, int steps) {
    distortion::MinimizeOptions options;
    options.max_iterations = steps;
    options.tolerance = kTrialTolerance;
    Stats ignored;
    return distortion::minimize_distortion(surface, uv, options, context_, ignored);
  }

  bool overlaps(const mesh::Surface& surface, const Points2& uv) const {
    return distortion::overlaps_itself(
        distortion::find_boundary(static_cast<Index>(uv.rows()), surface.faces), uv, context_);
  }

  LevelMap result(const Points2& uv) const {
    LevelMap map;
    map.slits = {cut_, by_corner(slit_.faces, uv), {}};
    map.stretch = stretch_of(chart_, map.slits.corner_uv);
    return map;
  }

  // The cut of the few, and of their pieces in turn where these lie on themselves.
  mesh::EdgeFlags divided_on(const mesh::Surface& few, const mesh::Adjacency& adjacency,
                             mesh::EdgeFlags cut) {
    for (const mesh::Chart& piece :
         mesh::split_into_charts(few.vertices, mesh::cut_along(few.faces, adjacency, cut))) {
      const mesh::Adjacency own = mesh::build_adjacency(
          static_cast<Index>(piece.surface.vertices.rows()), piece.surface.faces);
      TrialMap trial(piece.surface);
      trial.relax(own, mesh::EdgeFlags(own.opposite.size(), 0), kTrialTolerance, context_);
      if (!trial.overlaps_itself(context_)) continue;
      const TrialMap::Apart apart = trial.hold_apart(options_.bound, true, {}, context_);
      if (apart.cut.empty()) continue;
      const mesh::EdgeFlags further = divided_on(piece.surface, own, apart.cut);
      for (std::size_t h = 0; h < further.size(); ++h) {
        if (further[h] != 0) cut[in_chart(piece, h)] = 1;
      }
    }
    return cut;
  }

  // Every piece by levels of its own.
  LevelMap divided(const mesh::Adjacency& of_slit, const mesh::EdgeFlags& division) {
    levels_.clear();
    LevelMap map;
    map.slits.cut = cut_;
    map.slits.corner_uv.resize(slit_.faces.size(), 2);
    map.slits.apart.resize(slit_.faces.size(), 2);
    bool is_final = true;
    for (const mesh::Chart& piece :
         mesh::split_into_charts(slit_.vertices, mesh::cut_along(slit_.faces, of_slit, division))) {
      const mesh::Adjacency adjacency = mesh::build_adjacency(
          static_cast<Index>(piece.surface.vertices.rows()), piece.surface.faces);
      const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
      mesh::EdgeFlags uncuttable;
      for (std::size_t h = 0; h < none.size() && !uncuttable_.empty(); ++h)
        uncuttable.push_back(uncuttable_[in_chart(piece, h)]);
      Levels levels(piece.surface, adjacency, none, uncuttable, options_, context_);
      const LevelMap own =
          piece.surface.faces.rows() > kWorthLevels ? levels.run() : levels.without_levels();
      const bool again = own.slits.apart.rows() > 0;
      is_final = is_final && !again;
      for (std::size_t h = 0; h < none.size(); ++h) {
        const std::size_t corner = in_chart(piece, h);
        const auto row = static_cast<Eigen::Index>(corner);
        const auto own_row = static_cast<Eigen::Index>(h);
        if (own.slits.cut[h] != 0 || division[corner] != 0) map.slits.cut[corner] = 1;
        map.slits.corner_uv.row(row) = own.slits.corner_uv.row(own_row);
        map.slits.apart.row(row) = (again ? own.slits.apart : own.slits.corner_uv).row(own_row);
      }
    }
    if (is_final) map.slits.apart.resize(0, 2);
    map.stretch = stretch_of(chart_, map.slits.corner_uv);
    return map;
  }

  static std::size_t in_chart(const mesh::Chart& piece, std::size_t halfedge) {
    return 3 * static_cast<std::size_t>(piece.faces[halfedge / 3]) + halfedge % 3;
  }

  LevelMap without_levels() {
    TrialMap trial(chart_);
    LevelMap map;
    map.stretch = trial.relax(adjacency_, cut_, kTrialTolerance, context_);
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
  std::vector<mesh::Decimated> levels_;  // of the slit surface, each of the one before
};

}  // namespace

LevelMap map_by_levels(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                       const mesh::EdgeFlags& cut, const mesh::EdgeFlags& uncuttable,
                       const SlitOptions& options, ExecutionContext& context) {
  return Levels(chart, adjacency, cut, uncuttable, options, context).run();
}

}  // namespace flipfree::unwrap
