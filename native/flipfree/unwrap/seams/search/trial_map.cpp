#include "flipfree/unwrap/seams/search/trial_map.h"

#include <utility>

#include "flipfree/base/stats.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/chart/stretch.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

// From the last map on: what has not settled by then has moved enough to be judged.
constexpr int kFurtherSteps = 12;
constexpr int kFirstSteps = 60;
constexpr int kHeldTrialSteps = 40;

}  // namespace

mesh::Surface slit_surface(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cut) {
  mesh::CutMesh mesh = mesh::cut_along(chart.faces, adjacency, cut);
  mesh::Surface slit;
  slit.faces = std::move(mesh.faces);
  slit.vertices.resize(static_cast<Eigen::Index>(mesh.vertex_origin.size()), 3);
  for (std::size_t v = 0; v < mesh.vertex_origin.size(); ++v)
    slit.vertices.row(static_cast<Eigen::Index>(v)) = chart.vertices.row(mesh.vertex_origin[v]);
  return slit;
}

Stretch TrialMap::relax(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cut,
                        double tolerance, ExecutionContext& context) {
  slit_ = slit_surface(chart_, adjacency, cut);
  Stats ignored;
  if (corner_uv_.rows() == 0) {
    FlattenOptions options;
    options.bijective = false;
    options.acceptable = false;
    options.max_iterations = kFirstSteps;
    options.tolerance = tolerance;
    uv_ = flatten_chart(slit_, options, context, ignored).uv;
  } else {
    Points2 start(slit_.vertices.rows(), 2);
    for (CornerId c = 0; c < corner_uv_.rows(); ++c)
      start.row(slit_.faces.data()[c]) = corner_uv_.row(c);
    distortion::MinimizeOptions options;
    options.max_iterations = kFurtherSteps;
    options.tolerance = tolerance;
    uv_ = distortion::minimize_distortion(slit_, start, options, context, ignored);
  }
  corner_uv_ = by_corner(slit_.faces, uv_);
  return stretch_of(chart_, corner_uv_);
}

Stretch TrialMap::ease(const Stretch& most, ExecutionContext& context) {
  uv_ = eased(slit_, uv_, most, false, context);
  corner_uv_ = by_corner(slit_.faces, uv_);
  return stretch_of(chart_, corner_uv_);
}

TrialMap::Apart TrialMap::hold_apart(const Stretch& most, bool may_add_cuts,
                                     const mesh::EdgeFlags& uncuttable,
                                     ExecutionContext& context) const {
  FlattenOptions options;
  options.may_add_cuts = may_add_cuts;
  options.most_energy = most.energy;
  options.held_steps = kHeldTrialSteps;
  options.uncuttable = uncuttable;
  options.acceptable = false;
  Stats ignored;
  FlatChart flat = flatten_chart(slit_, options, context, ignored);
  if (flat.cut.empty()) flat.uv = eased(slit_, flat.uv, most, true, context);
  Apart apart;
  apart.corner_uv = by_corner(slit_.faces, flat.uv);
  apart.stretch = stretch_of(chart_, apart.corner_uv);
  apart.cut = std::move(flat.cut);
  if (!apart.cut.empty()) apart.apart = by_corner(slit_.faces, flat.apart);
  return apart;
}

bool TrialMap::overlaps_itself(const ExecutionContext& context) const {
  return distortion::overlaps_itself(
      distortion::find_boundary(static_cast<Index>(uv_.rows()), slit_.faces), uv_, context);
}

}  // namespace flipfree::unwrap
