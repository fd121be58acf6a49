#include "flipfree/seamless/padding/geometry/padded_metric.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/loops/surface_loops.h"
#include "flipfree/seamless/padding/disks/cut_disks.h"
#include "flipfree/seamless/padding/disks/near_metric.h"
#include "flipfree/seamless/padding/geometry/assembly.h"
#include "flipfree/seamless/padding/geometry/equalize.h"
#include "flipfree/seamless/padding/segments.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/penner/relaxation.h"

namespace flipfree::seamless {

using conformal::ConformalMetric;
using intrinsic::FlipMesh;

namespace {

// The half-edges of every side of the cut, in order, and how they are measured.
class MeasuredSides {
 public:
  MeasuredSides(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                const intrinsic::IntrinsicSetup& setup, const FlatSurface& flat) {
    halfedges_.resize(2 * cut.branches.size());
    lengths_.resize(halfedges_.size());
    for (std::size_t side = 0; side < halfedges_.size(); ++side) {
      for (const HalfedgeId h : side_halfedges(cut, adjacency, static_cast<Index>(side))) {
        const HalfedgeId g = setup.input_halfedge[at(h)];
        halfedges_[side].push_back(g);
        lengths_[side].push_back(norm(flat.vector[at(g)]));
      }
    }
  }

  const std::vector<HalfedgeId>& halfedges(Index side) const { return halfedges_[at(side)]; }
  const std::vector<Wide>& lengths(Index side) const { return lengths_[at(side)]; }
  Wide length(Index side) const {
    Wide sum(0.0);
    for (const Wide& l : lengths_[at(side)]) sum += l;
    return sum;
  }
  void scale(Index side, const Wide& factor) {
    for (Wide& l : lengths_[at(side)]) l *= factor;
  }

 private:
  std::vector<std::vector<HalfedgeId>> halfedges_;
  std::vector<std::vector<Wide>> lengths_;
};

std::vector<Wide> segment_lengths(const CutSegments& segments, const MeasuredSides& sides) {
  std::vector<Wide> length;
  for (const CutSegment& segment : segments.segments) {
    length.emplace_back(0.0);
    for (const Index side : segment.sides) length.back() += sides.length(side);
  }
  return length;
}

// Where the vertices of a branch lie in the end, as shares of its length, from its start on: half
// way between where they lie on its two sides.
std::vector<Wide> common_shares(const MeasuredSides& sides, Index side) {
  const std::vector<Wide>&one = sides.lengths(side), &two = sides.lengths(mate_of(side));
  const Wide all_one = sides.length(side), all_two = sides.length(mate_of(side));
  std::vector<Wide> share{Wide(0.0)};
  Wide from_one(0.0), from_two(0.0);
  for (std::size_t i = 0; i < one.size(); ++i) {
    from_one += one[i];
    from_two += two[two.size() - 1 - i];
    share.push_back(Wide(0.5) * (from_one / all_one + from_two / all_two));
  }
  share.back() = Wide(1.0);
  return share;
}

struct Move {
  HalfedgeId first;
  Wide along, outward;
};

class Padder {
 public:
  Padder(const AdmissibleCut& cut, const CutSegments& segments, MeasuredSides& sides,
         FlatSurface& flat)
      : cut_(cut), segments_(segments), sides_(sides), flat_(flat) {}

  // Scales the components, and pads every segment. Returns the largest width, over the longest
  // segment.
  double run(const ExecutionContext& context) {
    const EqualizationSystem system = equalization_system(cut_, segments_);
    scale_components(component_scales(segments_, system, segment_lengths(segments_, sides_)));
    const std::vector<Wide> length = segment_lengths(segments_, sides_);
    width_ = padding_widths(system, length);
    const std::vector<Wide> padded = padded_lengths(segments_, length, width_);
    final_length_.resize(2 * cut_.branches.size());
    for (std::size_t side = 0; side < final_length_.size(); ++side) {
      const Index segment = segments_.of_side[side];
      if (segments_.segments[at(segment)].sides.size() > 1) continue;
      const Index other = segments_.of_side[side ^ 1];
      final_length_[side] = segments_.segments[at(other)].sides.size() > 1
                                ? padded[at(segment)]
                                : Wide(0.5) * (padded[at(segment)] + padded[at(other)]);
      final_length_[side ^ 1] = final_length_[side];
    }
    move_all(context);
    Wide widest(0.0), longest(0.0);
    for (const Wide& w : width_) widest = std::max(widest, w);
    for (const Wide& l : length) longest = std::max(longest, l);
    return numeric::ratio(widest, longest);
  }

 private:
  void scale_components(const std::vector<double>& scale) {
    std::vector<char> seen(flat_.vector.size(), 0);
    std::vector<HalfedgeId> line;
    for (const CutSegment& segment : segments_.segments) {
      const Wide factor(scale[at(segment.component)]);
      for (const Index side : segment.sides) {
        sides_.scale(side, factor);
        line.push_back(sides_.halfedges(side).front());
      }
      while (!line.empty()) {
        const HalfedgeId h = line.back();
        line.pop_back();
        if (seen[at(h)]) continue;
        for (const HalfedgeId g : {h, flat_.mesh.next_of(h), flat_.mesh.previous(h)}) {
          seen[at(g)] = 1;
          flat_.vector[at(g)] = factor * flat_.vector[at(g)];
          if (!flat_.fixed[at(g >> 1)]) line.push_back(g ^ 1);
        }
      }
    }
  }

  // How the vertices of a segment but for its end move; the corner where it begins first.
  std::vector<Move> moves_of(Index segment) const {
    std::vector<Move> moves;
    Wide before = width_[at(segments_.previous(segment))];
    before = -before;  // of the new start, along the segment
    Wide old(0.0);
    for (const Index side : segments_.segments[at(segment)].sides) {
      const std::vector<HalfedgeId>& halfedges = sides_.halfedges(side);
      const std::vector<Wide> share = common_shares(sides_, side & ~1);
      for (std::size_t i = 0; i < halfedges.size(); ++i) {
        const Wide place = (side & 1) != 0 ? Wide(1.0) - share[halfedges.size() - i] : share[i];
        moves.push_back(
            {halfedges[i], before + place * final_length_[at(side)] - old, width_[at(segment)]});
        old += sides_.lengths(side)[i];
      }
      before += final_length_[at(side)];
    }
    return moves;
  }

  void move(const Move& m, const ExecutionContext& context) {
    // The surface is on the left, outside on the right.
    move_wedge(flat_, m.first, turned({m.along, -m.outward}, flat_.axis[at(m.first)]), context);
  }

  // Corners first. Then, so that no vertex of a segment passes its neighbour even where nothing
  // moves outwards, those that move towards the segment's end, last first, and the others.
  void move_all(const ExecutionContext& context) {
    std::vector<std::vector<Move>> moves;
    for (std::size_t s = 0; s < segments_.segments.size(); ++s)
      moves.push_back(moves_of(static_cast<Index>(s)));
    for (const auto& of_segment : moves) move(of_segment.front(), context);
    for (const auto& of_segment : moves) {
      for (std::size_t i = of_segment.size(); i-- > 1;) {
        if (of_segment[i].along.sign() > 0) move(of_segment[i], context);
      }
      for (std::size_t i = 1; i < of_segment.size(); ++i) {
        if (of_segment[i].along.sign() <= 0) move(of_segment[i], context);
      }
    }
  }

  const AdmissibleCut& cut_;
  const CutSegments& segments_;
  MeasuredSides& sides_;
  FlatSurface& flat_;
  std::vector<Wide> width_;         // per segment
  std::vector<Wide> final_length_;  // per side
};

// As a metric that was reached by flips from the surface's own triangulation.
ConformalMetric as_metric(const AdmissibleCut& cut, const intrinsic::IntrinsicSetup& setup,
                          const std::vector<Index>& cones, const FlatSurface& flat,
                          ExecutionContext& context) {
  ConformalMetric out;
  conformal::EngineInput input;
  input.setup = setup;
  input.vertex_count = static_cast<Index>(cones.size());
  input.positions = &cut.surface.vertices;
  input.target.assign(cones.size(), 0.0);
  const auto engine = make_engine(input, 53, context);
  engine->finish(out, false, context);
  out.mesh = setup.mesh;
  // From the Delaunay triangulation of the surface back to its own: four flips are none.
  const auto add = [&](EdgeId e) {
    intrinsic::FlipRecord record;
    record.plain = {1, {e, kInvalid, kInvalid}};
    out.flips.push_back(record);
  };
  for (std::size_t i = out.flips.size(); i-- > 0;) {
    const EdgeId e = out.flips[i].plain.edges[0];
    for (int k = 0; k < 3; ++k) add(e);
  }
  for (const EdgeId e : flat.flips) {
    intrinsic::flip_edge(out.mesh, e);
    add(e);
  }
  std::vector<Wide> length;
  Wide sum(0.0);
  for (std::size_t e = 0; e < flat.mesh.edge_count(); ++e) {
    length.push_back(norm(flat.vector[2 * e]));
    sum += length.back();
  }
  const Wide mean = sum / Wide(static_cast<double>(length.size()));
  std::vector<double> rounded;
  for (const Wide& l : length) rounded.push_back(numeric::ratio(l, mean));
  out.scale_factors = vertex_means(out.mesh, ReferenceMetric(out).ratios(rounded));
  const auto [low, high] = std::minmax_element(out.scale_factors.begin(), out.scale_factors.end());
  out.scale_range = *high - *low;
  out.u = out.scale_factors;
  out.length = std::move(rounded);
  out.angles.assign(cones.size(), 0.0);
  out.converged = true;
  return out;
}

}  // namespace

bool come_near(const AdmissibleCut& cut, const std::vector<Index>& cones, int most, double enough,
               PaddedMetric& padded, ExecutionContext& context) {
  constexpr double kTolerance = 1e-6;  // radians, of every step
  constexpr double kWrongTurn = 0.1;
  ConformalMetric& metric = padded.metric;
  const intrinsic::IntrinsicSetup setup =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(cones.size()), cut.surface.faces);
  PennerTargets targets;
  for (const Index k : cones) targets.vertex_angle.push_back(k * kQuarterTurn);
  conformal::EngineInput input;
  input.setup = {metric.mesh, metric.input_halfedge, metric.on_boundary};
  input.vertex_count = static_cast<Index>(cones.size());
  input.edge_length = intrinsic::to_doubles(metric.length);
  input.target = targets.vertex_angle;
  CarriedMetric carried{
      make_engine(input, 53, context),
      {setup.mesh,
       intrinsic::homology_basis(setup.mesh, intrinsic::steps_across(cut.surface, setup), context)},
      ReferenceMetric(metric)};
  if (!carried.engine->started()) return false;
  intrinsic::replay_flips(metric.flips, 0, metric.flips.size(), context,
                          [&](EdgeId e) { carried.loops.flip(e); });
  const auto& flips = carried.engine->flips();
  intrinsic::replay_flips(flips, 0, flips.size(), context, [&](EdgeId e) {
    carried.loops.flip(e);
    carried.reference.flip(e);
  });
  // What the loops turn by now is what they shall turn by, but for rounding.
  targets.loop_angle.assign(carried.loops.size(), 0.0);
  PennerAngles angles;
  measure(*carried.engine, carried.loops, targets, angles, context);
  for (std::size_t i = 0; i < angles.loops.size(); ++i) {
    const double turns = std::round(-angles.loops[i] / kQuarterTurn);
    targets.loop_angle[i] = turns * kQuarterTurn;
    if (!(std::abs(-angles.loops[i] - targets.loop_angle[i]) < kWrongTurn)) return false;
  }
  PennerNewtonOptions newton;
  const std::size_t first = flips.size();
  if (run_penner(carried.engine, carried.loops, targets, newton, context).end !=
      PennerEnd::kConverged) {
    return false;
  }
  intrinsic::replay_flips(carried.engine->flips(), first, carried.engine->flips().size(), context,
                          [&](EdgeId e) { carried.reference.flip(e); });
  padded.steps += come_near(carried, targets, kTolerance, most, enough, context);
  ConformalMetric near;
  carried.engine->finish(near, false, context);
  metric.flips.insert(metric.flips.end(), near.flips.begin(), near.flips.end());
  metric.mesh = std::move(near.mesh);
  metric.length = std::move(near.length);
  metric.scale_factors =
      vertex_means(metric.mesh, carried.reference.ratios(carried.engine->lengths()));
  const auto [low, high] =
      std::minmax_element(metric.scale_factors.begin(), metric.scale_factors.end());
  metric.scale_range = *high - *low;
  metric.u = metric.scale_factors;
  padded.energy = carried.energy();
  return true;
}

PaddedMetric compute_padded_metric(const AdmissibleCut& cut, const std::vector<Index>& cones,
                                   ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(cut.surface.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, cut.surface.faces);
  const CutSegments segments = cut_segments(cut, adjacency);
  PaddedMetric out;
  out.components = segments.component_count();
  out.segments = segments.segments.size();
  std::vector<CutDisk> disks;
  {
    const ProgressRange range(context, 0.0, 0.8);
    disks = solve_disks(cut, adjacency, segments, cones, context);
  }
  for (const CutDisk& disk : disks) {
    out.bits = std::max(out.bits, disk.bits);
    out.scale_range = std::max(out.scale_range, disk.scale_range);
    out.metric.iterations += disk.iterations;
  }
  const int iterations = out.metric.iterations;
  const intrinsic::IntrinsicSetup setup =
      intrinsic::build_intrinsic_mesh(vertex_count, cut.surface.faces);
  context.report("padding", 0.8);
  AssembledSurface assembled = assemble(disks, setup, cut, context);
  out.closing_error = assembled.closing_error;
  FlatSurface& flat = assembled.flat;
  MeasuredSides sides(cut, adjacency, setup, flat);
  out.largest_width = Padder(cut, segments, sides, flat).run(context);
  std::vector<EdgeId> seams;
  for (std::size_t e = 0; e < flat.fixed.size(); ++e) {
    if (flat.fixed[e]) seams.push_back(static_cast<EdgeId>(e));
  }
  glue(flat, seams);
  make_delaunay(flat, context);
  out.metric = as_metric(cut, setup, cones, flat, context);
  out.metric.iterations = iterations;
  return out;
}

}  // namespace flipfree::seamless
