#include "flipfree/seamless/padding/padded_metric.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/seamless/padding/disk_metric.h"
#include "flipfree/seamless/padding/segments.h"
#include "flipfree/seamless/penner/relaxation.h"

namespace flipfree::seamless {

namespace {

using intrinsic::FlipMesh;

// Radians that a frame may miss a quarter turn by.
constexpr double kLargestClosingError = 1e-2;

// The flat metric of one disk as vectors, written to `out` under the names `name` (per half-edge of
// the disk).
class Development {
 public:
  Development(const HalfTriangulation& half, const std::vector<HalfedgeId>& name, FlatSurface& out)
      : half_(half), name_(name), out_(out) {
    for (std::size_t h = 0; h < half.inside.size(); ++h) {
      if (!half.inside[h]) continue;
      if (!open(static_cast<HalfedgeId>(h)) && first_ == kInvalid)
        first_ = static_cast<HalfedgeId>(h);
    }
  }

  // Returns the closing error.
  double run(const ExecutionContext& context) {
    std::vector<char> placed(half_.inside.size(), 0);
    // Large edges first: small triangles come last, between large ones that are known.
    std::priority_queue<std::pair<std::int64_t, HalfedgeId>> front;
    const auto enter = [&](HalfedgeId h, const WideVector& side) {
      place_face(h, side);
      for (const HalfedgeId g : {h, half_.mesh.next_of(h), half_.mesh.previous(h)}) {
        placed[at(g)] = 1;
        if (open(g) && !placed[at(g ^ 1)]) front.push({exponent(g >> 1), g});
      }
    };
    enter(first_, {half_.length[at(first_ >> 1)], Wide(0.0)});
    for (std::size_t count = 0; !front.empty(); ++count) {
      if (count % 1024 == 0) context.check();
      const HalfedgeId g = front.top().second;
      front.pop();
      if (!placed[at(g ^ 1)]) enter(g ^ 1, -vector(g));
    }
    double error = 0.0;
    for (std::size_t h = 0; h < placed.size(); h += 2) {
      const auto g = static_cast<HalfedgeId>(h);
      if (half_.inside[h] && open(g)) error = std::max(error, match(g));
    }
    return error;
  }

 private:
  // Is there more of the disk beyond h?
  bool open(HalfedgeId h) const { return half_.inside[at(h)] && half_.inside[at(h ^ 1)]; }
  WideVector& vector(HalfedgeId h) { return out_.vector[at(name_[at(h)])]; }
  std::int64_t exponent(EdgeId e) const {
    std::int64_t x = 0;
    half_.length[at(e)].to_double_scaled(x);
    return x;
  }

  // The face of h, from the vector of h and the lengths.
  void place_face(HalfedgeId h, const WideVector& side) {
    const HalfedgeId n = half_.mesh.next_of(h), p = half_.mesh.next_of(n);
    const Wide &a = half_.length[at(h >> 1)], &b = half_.length[at(n >> 1)],
               &c = half_.length[at(p >> 1)];
    const Wide two(2.0);
    const Wide along = (a + ((c - b) / a) * (c + b)) / two;
    const Wide square = (a + b + c) * ((c - a) + b) * ((b - c) + a) * ((c - b) + a);
    if (square.sign() <= 0) throw_unpadded(kImprecise);
    const Wide height = sqrt(square) / (two * a);
    const Wide x = along / a, y = height / a;
    vector(h) = side;
    vector(p) = -(WideVector{x * side.x - y * side.y, x * side.y + y * side.x});
    vector(n) = -(vector(h) + vector(p));
  }

  // The quarter turns across an edge; how far from them it is.
  double match(HalfedgeId h) {
    const WideVector a = vector(h), b = -vector(h ^ 1);
    const Index t = turns_between(a, b);
    out_.turns[at(name_[at(h)])] = t;
    out_.turns[at(name_[at(h ^ 1)])] = (4 - t) & 3;
    const WideVector c = turned(a, t);
    return std::abs(numeric::ratio(cross(c, b), dot(c, b)));
  }

  const HalfTriangulation& half_;
  const std::vector<HalfedgeId>& name_;
  FlatSurface& out_;
  HalfedgeId first_ = kInvalid;
};

}  // namespace

FlatSurface assemble(const std::vector<CutDisk>& disks, const intrinsic::IntrinsicSetup& setup,
                     const AdmissibleCut& cut, const ExecutionContext& context) {
  FlatSurface flat;
  double closing_error = 0.0;  // largest angle that frames miss quarter turns by, radians
  flat.mesh = setup.mesh;
  flat.vector.resize(flat.mesh.halfedge_count());
  flat.turns.assign(flat.mesh.halfedge_count(), 0);
  flat.fixed.assign(flat.mesh.edge_count(), 0);
  flat.axis.assign(flat.mesh.halfedge_count(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flat.fixed[at(setup.input_halfedge[at(h)] >> 1)] = 1;
  }
  for (const CutDisk& disk : disks) {
    const HalfTriangulation& half = disk.half;
    std::vector<HalfedgeId> name(half.home.size(), kInvalid);
    for (std::size_t h = 0; h < name.size(); ++h) {
      const HalfedgeId c = half.home[h];
      if (c != kInvalid)
        name[h] = setup.input_halfedge[at(3 * disk.chart.faces[at(c / 3)] + c % 3)];
    }
    // Backwards from home. A flip that undoes another one leaves the halves exchanged.
    for (std::size_t i = half.flips_home.size(); i-- > 0;) {
      if (i % 65536 == 65535) context.check();
      const auto e = at(half.flips_home[i]);
      intrinsic::flip_edge(flat.mesh, name[2 * e] >> 1);
      flat.flips.push_back(name[2 * e] >> 1);
      std::swap(name[2 * e], name[2 * e + 1]);
    }
    for (std::size_t h = 0; h < name.size(); ++h) {
      if (name[h] == kInvalid) continue;
      const HalfedgeId next = name[at(half.mesh.next[h])];
      if (flat.mesh.next_of(name[h]) != next)
        throw InternalError("assembly: the way home does not lead back");
    }
    closing_error = std::max(closing_error, Development(half, name, flat).run(context));
  }
  for (std::size_t h = 0; h < flat.axis.size(); ++h) {
    if (flat.fixed[h / 2]) flat.axis[h] = turns_between({Wide(1.0), Wide(0.0)}, flat.vector[h]);
  }
  if (!(closing_error < kLargestClosingError)) {
    throw_unpadded("The metric of a piece of the surface closes only up to " +
                   std::to_string(closing_error) + " radians");
  }
  return flat;
}

namespace {

// Lengths are equal if they differ by less than this share of the longest one; every refinement
// gains some 45 bits of it.
constexpr int kEqualBits = 160;
// What rounding of the metric may leave where rows depend on each other: in the fourfold case
// lengths that cannot be changed alone are equal by themselves.
constexpr double kLeftOver = 1e-6;

// Of a segment after padding (5.2).
Wide padded_length(const CutSegments& segments, const std::vector<Wide>& length,
                   const std::vector<Wide>& width, Index segment) {
  return width[at(segments.previous(segment))] + length[at(segment)] +
         width[at(segments.next(segment))];
}

// Widths w >= 0, one per segment, by which mates become equally long in the precision of the
// lengths (in the fourfold case, where rows depend on each other, up to what the lengths miss of
// that): a solution of small norm, then the same number added to all of them (those of the extra
// path stay zero: Proposition 12). Throws InternalError if there is none, which no cut of padding.h
// allows. Cost: cubic in the number of segments, small.
std::vector<Wide> padding_widths(const AdmissibleCut& cut, const CutSegments& segments,
                                 const std::vector<Wide>& length) {
  const std::vector<EqualizationRow> rows = equalization_rows(segments);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()),
                                            static_cast<Eigen::Index>(length.size()));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto add = [&](Index segment, double sign) {
      a(static_cast<Eigen::Index>(r), segments.previous(segment)) += sign;
      a(static_cast<Eigen::Index>(r), segments.next(segment)) += sign;
    };
    add(rows[r].segment, 1.0);
    for (const Index mate : rows[r].mates) add(mate, -1.0);
  }
  std::vector<char> padded(length.size(), 1);
  for (Index side = 2 * cut.extra_path; cut.extra_path != kInvalid && side < 2 * cut.extra_path + 2;
       ++side) {
    const Index unpadded = segments.of_side[at(side)];
    padded[at(unpadded)] = 0;
    a.col(unpadded).setZero();
  }
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(a);
  const Wide longest = *std::max_element(length.begin(), length.end());
  std::vector<Wide> width(padded.size(), Wide(0.0, kWideBits));
  Wide before = Wide(2.0 * static_cast<double>(length.size()) + 2.0) * longest;
  for (;;) {
    std::vector<Wide> rest;
    Wide most(0.0);
    for (const auto& [segment, mates] : rows) {
      rest.push_back(-padded_length(segments, length, width, segment));
      for (const Index mate : mates) rest.back() += padded_length(segments, length, width, mate);
      most = std::max(most, abs(rest.back()));
    }
    if (most <= Wide(std::ldexp(1.0, -kEqualBits)) * longest) break;
    if (most > Wide(0.5) * before) {
      if (most <= Wide(kLeftOver) * longest) break;
      throw InternalError("padding: the equalization system has no solution");
    }
    before = most;
    Eigen::VectorXd right(a.rows());
    for (std::size_t r = 0; r < rows.size(); ++r)
      right[static_cast<Eigen::Index>(r)] = numeric::ratio(rest[r], most);
    const Eigen::VectorXd step = solver.solve(right);
    for (std::size_t s = 0; s < width.size(); ++s) {
      if (padded[s]) width[s] += most * Wide(step[static_cast<Eigen::Index>(s)]);
    }
  }
  const Wide least = std::min(Wide(0.0), *std::min_element(width.begin(), width.end()));
  for (std::size_t s = 0; s < width.size(); ++s) {
    if (padded[s]) width[s] -= least;
  }
  return width;
}

}  // namespace

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
  Padder(const AdmissibleCut& cut, const CutSegments& segments, const MeasuredSides& sides,
         FlatSurface& flat)
      : cut_(cut), segments_(segments), sides_(sides), flat_(flat) {}

  // Pads every segment. Returns the largest width, over the longest segment.
  double run(const ExecutionContext& context) {
    const std::vector<Wide> length = segment_lengths(segments_, sides_);
    width_ = padding_widths(cut_, segments_, length);
    std::vector<Wide> padded;
    for (std::size_t s = 0; s < length.size(); ++s)
      padded.push_back(padded_length(segments_, length, width_, static_cast<Index>(s)));
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
    move_wedge(flat_, m.first, turned(WideVector{m.along, -m.outward}, flat_.axis[at(m.first)]),
               context);
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
  const MeasuredSides& sides_;
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

PaddedMetric compute_padded_metric(const AdmissibleCut& cut, const std::vector<Index>& cones,
                                   ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(cut.surface.vertices.rows());
  const mesh::Adjacency& adjacency = cut.surface.adjacency();
  const CutSegments segments = cut_segments(cut, adjacency);
  PaddedMetric out;
  out.components = segments.component_count();
  std::vector<CutDisk> disks;
  {
    const ProgressRange range(context, 0.0, 0.8);
    disks = solve_disks(cut, adjacency, segments, cones, context);
  }
  const intrinsic::IntrinsicSetup setup =
      intrinsic::build_intrinsic_mesh(vertex_count, cut.surface.faces);
  context.report("padding", 0.8);
  FlatSurface flat = assemble(disks, setup, cut, context);
  const MeasuredSides sides(cut, adjacency, setup, flat);
  out.largest_width = Padder(cut, segments, sides, flat).run(context);
  std::vector<EdgeId> seams;
  for (std::size_t e = 0; e < flat.fixed.size(); ++e) {
    if (flat.fixed[e]) seams.push_back(static_cast<EdgeId>(e));
  }
  glue(flat, seams);
  make_delaunay(flat, context);
  out.metric = as_metric(cut, setup, cones, flat, context);
  return out;
}

}  // namespace flipfree::seamless
