#include "flipfree/seamless/padding/padding.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/request.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {

namespace {

// From an admissible cut to a seamless metric (thesis 5.2.2 to 5.2.5, 5.4.2 to 5.4.5).
//
//   solve_disks()      metrics with straight boundary         disk_metric.h
//   assemble()         vectors in frames along the axes
//   padding_widths()   how far every segment is padded
//   move_wedge()       stretch and shift
//   glue(), make_delaunay()
//
// Deviation from the thesis: the metric is padded, not a map. A vertex of a segment moves outwards
// by the segment's width and along it to its place (stretch and shift at once); triangles that it
// would turn over are flipped. That is the thesis' padded map up to isotopy, with strips thinner
// than anything, and needs neither lines across the mesh nor new vertices.

using conformal::ConformalMetric;

// A flat surface with cones in quarter turns, as a triangulation whose half-edges are vectors: what
// a metric is while it is padded.
//
// Every face has a frame of its own; across an edge frames differ by quarter turns:
//
//     vector(opposite(h)) = -R^turns(h) vector(h),    R = (x, y) -> (-y, x)
//
// No place is ever measured from afar: what is small stays exact however large the rest is.
//
// `fixed` edges are where the surface is still cut: their two halves are not related, and they are
// not flipped.

struct FlatSurface {
  intrinsic::FlipMesh mesh;
  std::vector<WideVector> vector;  // per half-edge, in the frame of its face
  std::vector<Index> turns;        // per half-edge, 0 to 3: from its face's frame to its opposite's
  std::vector<char> fixed;         // per edge
  std::vector<Index> axis;         // per half-edge of a fixed edge, else any: the direction of the
                                   // segment that it belongs to in the frame of its face, 0 to 3
  std::vector<EdgeId> flips;       // done so far

  // Precondition: the two faces of e differ, e is not fixed.
  void flip(EdgeId e) {
    const HalfedgeId h = 2 * e, o = h + 1;
    // The frame of the other face becomes that of this one.
    const Index t = turns[at(h)];
    const HalfedgeId on = mesh.next_of(o), op = mesh.next_of(on);
    if (t != 0) {
      for (const HalfedgeId g : {o, on, op}) {
        vector[at(g)] = turned(vector[at(g)], 4 - t);
        axis[at(g)] = (axis[at(g)] + 4 - t) & 3;
        turns[at(g)] = (turns[at(g)] + t) & 3;
        turns[at(g ^ 1)] = (turns[at(g ^ 1)] + 4 - t) & 3;
      }
    }
    const HalfedgeId hn = mesh.next_of(h), hp = mesh.next_of(hn);
    vector[at(h)] = -(vector[at(hp)] + vector[at(on)]);
    vector[at(o)] = -(vector[at(op)] + vector[at(hn)]);
    intrinsic::flip_edge(mesh, e);
    flips.push_back(e);
  }
};

// Flips per edge after which there is no end in sight.
constexpr std::size_t kMostFlips = 200;
// Cotangents, relative to their terms, that count as the opposite of each other: cocircular points
// of a metric that is known to so many places must not be flipped for ever.
constexpr double kCocircular = 1e-9;

// A corner of the star that moves: the corner at the origin of `h`, and by how much, in its frame.
struct MovingCorner {
  HalfedgeId h;
  WideVector shift;
};

std::vector<MovingCorner> wedge_of(const FlatSurface& s, HalfedgeId first, WideVector shift) {
  std::vector<MovingCorner> wedge;
  for (HalfedgeId h = first;;) {
    wedge.push_back({h, shift});
    const HalfedgeId p = s.mesh.previous(h);
    if (s.fixed[at(p >> 1)]) return wedge;
    if (wedge.size() > s.mesh.halfedge_count())
      throw_unpadded("The padded metric was not reached: a wedge has no end");
    shift = turned(shift, s.turns[at(p)]);
    h = p ^ 1;
  }
}

// A face of the star: area(t) = a + b t + c t^2 while its corners move.
struct MovingFace {
  HalfedgeId h;
  WideVector rate[3];  // of the vectors of h, next(h), previous(h)
  Wide a, b, c;

  MovingFace(const FlatSurface& s, const std::vector<MovingCorner>& wedge, HalfedgeId face) {
    h = face;
    HalfedgeId g = face;
    WideVector moved[3];
    for (auto& corner : moved) {
      for (const MovingCorner& m : wedge) {
        if (m.h == g) corner = m.shift;
      }
      g = s.mesh.next_of(g);
    }
    for (int k = 0; k < 3; ++k) rate[k] = moved[(k + 1) % 3] - moved[k];
    const WideVector& e0 = s.vector[at(h)];
    const WideVector& e1 = s.vector[at(s.mesh.next_of(h))];
    a = cross(e0, e1);
    b = cross(e0, rate[1]) + cross(rate[0], e1);
    c = cross(rate[0], rate[1]);
  }

  // When the area stops being positive, from `now` on; more than 1 if it does not.
  Wide end(const Wide& now) const {
    const Wide square = b * b - Wide(4.0) * a * c, two(2.0);
    if (square.sign() > 0) {
      // The root at which the area falls: a + b t + c t^2 has derivative -sqrt(square) there. (No
      // number where c is 0 and the area does not fall.)
      const Wide root = sqrt(square);
      const Wide t = b.sign() >= 0 ? -(b + root) / (two * c) : (two * a) / (root - b);
      if (t >= now && t <= Wide(1.0)) return t;
    }
    return (a + b + c).sign() > 0 ? two : now;
  }

  // The longest side at time t: the one that is in the way.
  HalfedgeId longest(const FlatSurface& s, const Wide& t) const {
    HalfedgeId g = h, best = h;
    Wide most(-1.0);
    for (const WideVector& r : rate) {
      const WideVector v = s.vector[at(g)] + t * r;
      const Wide size = dot(v, v);
      if (size > most) {
        most = size;
        best = g;
      }
      g = s.mesh.next_of(g);
    }
    return best;
  }
};

// Sum of the cotangents opposite to an edge, times both areas; and of their absolute values.
struct CotangentSum {
  Wide sum, size;
};
CotangentSum cotangents(const FlatSurface& s, EdgeId e) {
  Wide area[2], along[2];
  for (int side = 0; side < 2; ++side) {
    const HalfedgeId n = s.mesh.next_of(2 * e + side), p = s.mesh.next_of(n);
    along[side] = -dot(s.vector[at(n)], s.vector[at(p)]);
    area[side] = -cross(s.vector[at(p)], s.vector[at(n)]);
  }
  const Wide a = along[0] * area[1], b = along[1] * area[0];
  return {a + b, abs(a) + abs(b)};
}

// Moves the wedge of a vertex between two fixed edges by `shift`, given in the frame of the first
// face: that of the half-edge `first`, which leaves the vertex along a fixed edge, the surface on
// its left. Triangles that would turn over are flipped out of the way as the vertex reaches them,
// so the triangulation stays one; where the vertex passes, the surface must have no vertex and no
// fixed edge. Throws NotConverged (kIterationLimit) if there is one. Cost: a few flips, each the
// degree.
void move_wedge(FlatSurface& surface, HalfedgeId first, const WideVector& shift,
                const ExecutionContext& context) {
  std::vector<MovingCorner> wedge = wedge_of(surface, first, shift);
  Wide now(0.0);
  const Wide one(1.0);
  for (std::size_t flips = 0;; ++flips) {
    if (flips % 256 == 255) context.check();
    if (flips > kMostFlips * surface.mesh.edge_count())
      throw_unpadded("The padded metric was not reached: a vertex has no way");
    Wide soonest(2.0);
    HalfedgeId in_the_way = kInvalid;
    for (const MovingCorner& corner : wedge) {
      const MovingFace face(surface, wedge, corner.h);
      const Wide end = face.end(now);
      if (end <= one && (in_the_way == kInvalid || end < soonest)) {
        soonest = end;
        in_the_way = face.longest(surface, end);
      }
    }
    if (in_the_way == kInvalid) break;
    const EdgeId e = in_the_way >> 1;
    if (surface.fixed[at(e)] || intrinsic::is_glued_to_itself(surface.mesh, e))
      throw_unpadded("The padded metric was not reached: a vertex met the boundary on its way");
    now = soonest;
    // Flipping changes the frames of faces and who has a corner where; the first corner stays.
    const bool first_turns =
        surface.mesh.previous(first) == (e << 1 | 1) || surface.mesh.next_of(first) == (e << 1 | 1);
    const Index t = surface.turns[at(e << 1)];
    WideVector own = wedge.front().shift;
    if (first_turns) own = turned(own, 4 - t);
    surface.flip(e);
    wedge = wedge_of(surface, first, own);
  }
  for (const MovingCorner& corner : wedge) {
    const HalfedgeId p = surface.mesh.previous(corner.h);
    surface.vector[at(corner.h)] = surface.vector[at(corner.h)] - corner.shift;
    surface.vector[at(p)] = surface.vector[at(p)] + corner.shift;
  }
}

// Flips until every edge that is not fixed is Delaunay, as far as vectors of metrics that were
// reached to about 1e-10 tell. Precondition: all areas positive. Throws NotConverged if there is no
// end.
void make_delaunay(FlatSurface& surface, const ExecutionContext& context) {
  const std::size_t count = surface.mesh.edge_count();
  std::vector<EdgeId> line;
  std::vector<char> waiting(count, 1);
  line.reserve(count);
  for (std::size_t e = count; e-- > 0;) line.push_back(static_cast<EdgeId>(e));
  std::size_t flips = 0, tests = 0;
  while (!line.empty()) {
    const EdgeId e = line.back();
    line.pop_back();
    waiting[at(e)] = 0;
    if (++tests % 256 == 0) context.check();
    if (surface.fixed[at(e)] || intrinsic::is_glued_to_itself(surface.mesh, e)) continue;
    const CotangentSum cot = cotangents(surface, e);
    if (!(cot.sum < Wide(-kCocircular) * cot.size)) continue;
    if (++flips > kMostFlips * count)
      throw_unpadded("The padded metric was not reached: it has no Delaunay triangulation");
    surface.flip(e);
    for (const HalfedgeId h : {2 * e, 2 * e + 1}) {
      for (const HalfedgeId g : {surface.mesh.next_of(h), surface.mesh.previous(h)}) {
        if (waiting[at(g >> 1)]) continue;
        waiting[at(g >> 1)] = 1;
        line.push_back(g >> 1);
      }
    }
  }
}

// Radians that a frame may miss a quarter turn by.
constexpr double kLargestClosingError = 1e-2;

// The flat metric of one disk as vectors, written to `out` under the names `name` (per half-edge of
// the disk).
class Development {
 public:
  Development(const HalfTriangulation& half, const std::vector<HalfedgeId>& name, FlatSurface& out)
      : half_(half), name_(name), out_(out) {
    while (name_[at(first_)] == kInvalid || open(first_)) ++first_;
  }

  // Returns the closing error.
  double run(const ExecutionContext& context) {
    std::vector<char> placed(name_.size(), 0);
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
      if (open(g)) error = std::max(error, match(g));
    }
    return error;
  }

 private:
  // Is there more of the disk beyond h?
  bool open(HalfedgeId h) const { return name_[at(h)] != kInvalid && name_[at(h ^ 1)] != kInvalid; }
  WideVector& vector(HalfedgeId h) { return out_.vector[at(name_[at(h)])]; }
  std::int64_t exponent(EdgeId e) const {
    std::int64_t x = 0;
    Wide::scaled(half_.length[at(e)], x);
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
  HalfedgeId first_ = 0;
};

// The pieces of a cut surface in one triangulation again, each flat, the cut still open. `setup`:
// of the surface that is cut; `flips` of the result lead from its mesh to that of the result. Edges
// of the cut are `fixed` and keep their half-edges. Every frame has the cut along its axes. Throws
// NotConverged if the metrics are not precise enough. Cost: O(#F log #F).
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

// How far every segment is padded so that the two sides of every branch become equally long
// (thesis 5.2.5, 5.4.3).

// One of A w = b, the lengths of mates equal after padding (5.3, 5.5): of each segment that is not
// one of several mates of another one. Both sides of a branch never lie at flat sectors (Definition
// 5.4).
struct EqualizationRow {
  Index segment = kInvalid;
  std::vector<Index> mates;  // one per side of the segment
};
std::vector<EqualizationRow> equalization_rows(const CutSegments& segments) {
  std::vector<EqualizationRow> rows;
  for (Index i = 0; at(i) < segments.segments.size(); ++i) {
    EqualizationRow row{i, {}};
    for (const Index side : segments.segments[at(i)].sides)
      row.mates.push_back(segments.of_side[at(side ^ 1)]);
    // The complex one of the two has the row; of two simple ones the first.
    const Index j = row.mates.front();
    const bool has_row =
        row.mates.size() > 1 || (segments.segments[at(j)].sides.size() == 1 && i <= j);
    if (has_row) rows.push_back(std::move(row));
  }
  return rows;
}

// Lengths are equal if they differ by less than this share of the longest one; every refinement
// gains some 45 bits of it.
constexpr int kEqualBits = 160;
// What rounding of the metric may leave where rows depend on each other: in the fourfold case
// lengths that cannot be changed alone are equal by themselves.
constexpr double kLeftOver = 1e-6;

// Of a segment after padding (5.2).
Wide padded_length(const CutSegments& segments, const std::vector<Wide>& length,
                   const std::vector<Wide>& width, Index segment) {
  const auto& [previous, next, sides] = segments.segments[at(segment)];
  return width[at(previous)] + length[at(segment)] + width[at(next)];
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
      a(static_cast<Eigen::Index>(r), segments.segments[at(segment)].previous) += sign;
      a(static_cast<Eigen::Index>(r), segments.segments[at(segment)].next) += sign;
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

// A side of the cut: its half-edges, in order, and how they are measured.
struct MeasuredSide {
  std::vector<HalfedgeId> halfedges;
  std::vector<Wide> lengths;
  Wide length = Wide(0.0);
};

std::vector<MeasuredSide> measured_sides(const AdmissibleCut& cut,
                                         const intrinsic::IntrinsicSetup& setup,
                                         const FlatSurface& flat) {
  std::vector<MeasuredSide> sides(2 * cut.branches.size());
  for (std::size_t s = 0; s < sides.size(); ++s) {
    for (const HalfedgeId h : side_halfedges(cut, static_cast<Index>(s))) {
      const HalfedgeId g = setup.input_halfedge[at(h)];
      sides[s].halfedges.push_back(g);
      sides[s].lengths.push_back(norm(flat.vector[at(g)]));
      sides[s].length += sides[s].lengths.back();
    }
  }
  return sides;
}

// Where the vertices of a branch lie in the end, as shares of its length, from its start on: half
// way between where they lie on its two sides.
std::vector<Wide> common_shares(const MeasuredSide& one, const MeasuredSide& two) {
  const std::size_t count = one.lengths.size();
  std::vector<Wide> share{Wide(0.0)};
  Wide from_one(0.0), from_two(0.0);
  for (std::size_t i = 0; i < count; ++i) {
    from_one += one.lengths[i];
    from_two += two.lengths[count - 1 - i];
    share.push_back(Wide(0.5) * (from_one / one.length + from_two / two.length));
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
  Padder(const AdmissibleCut& cut, const CutSegments& segments, std::vector<MeasuredSide> sides,
         FlatSurface& flat)
      : cut_(cut), segments_(segments), sides_(std::move(sides)), flat_(flat) {}

  // Pads every segment.
  void run(const ExecutionContext& context) {
    std::vector<Wide> length;
    for (const CutSegment& segment : segments_.segments) {
      length.emplace_back(0.0);
      for (const Index side : segment.sides) length.back() += sides_[at(side)].length;
    }
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
  }

 private:
  // How the vertices of a segment but for its end move; the corner where it begins first.
  std::vector<Move> moves_of(Index segment) const {
    std::vector<Move> moves;
    // Of the new start, along the segment.
    Wide before = -width_[at(segments_.segments[at(segment)].previous)];
    Wide old(0.0);
    for (const Index side : segments_.segments[at(segment)].sides) {
      const std::vector<HalfedgeId>& halfedges = sides_[at(side)].halfedges;
      const std::vector<Wide> share = common_shares(sides_[at(side & ~1)], sides_[at(side | 1)]);
      for (std::size_t i = 0; i < halfedges.size(); ++i) {
        const Wide place = (side & 1) != 0 ? Wide(1.0) - share[halfedges.size() - i] : share[i];
        moves.push_back(
            {halfedges[i], before + place * final_length_[at(side)] - old, width_[at(segment)]});
        old += sides_[at(side)].lengths[i];
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
  const std::vector<MeasuredSide> sides_;
  FlatSurface& flat_;
  std::vector<Wide> width_;         // per segment
  std::vector<Wide> final_length_;  // per side
};

// Closes the cut, whose edges must be of the same length on both sides.
void glue(FlatSurface& flat) {
  for (HalfedgeId h = 0; at(h / 2) < flat.fixed.size(); h += 2) {
    if (std::exchange(flat.fixed[at(h / 2)], 0) == 0) continue;
    flat.turns[at(h)] = turns_between(flat.vector[at(h)], -flat.vector[at(h + 1)]);
    flat.turns[at(h + 1)] = (4 - flat.turns[at(h)]) & 3;
  }
}

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

// On cut.surface: flat but for the cones, all loops turn by quarter turns, up to the angle errors
// of the disks' metrics. Its flips lead from the surface's own triangulation to it. `cones`:
// quarter turns per vertex of cut.surface. Throws NotConverged, Cancelled.
ConformalMetric padded_metric(const AdmissibleCut& cut, const std::vector<Index>& cones,
                              ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(cut.surface.vertices.rows());
  const CutSegments segments = cut_segments(cut);
  std::vector<CutDisk> disks;
  {
    const ProgressRange range(context, 0.0, 0.8);
    disks = solve_disks(cut, segments, cones, context);
  }
  const intrinsic::IntrinsicSetup setup =
      intrinsic::build_intrinsic_mesh(vertex_count, cut.surface.faces);
  context.report("padding", 0.8);
  FlatSurface flat = assemble(disks, setup, cut, context);
  Padder(cut, segments, measured_sides(cut, setup, flat), flat).run(context);
  glue(flat);
  make_delaunay(flat, context);
  return as_metric(cut, setup, cones, flat, context);
}

// The pairs that are still edges of the refined surface.
IndexPairs edges_left(const IndexPairs& pairs, const mesh::Surface& surface) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  return mesh::flagged_edges(surface.faces, surface.adjacency(),
                             mesh::flag_pairs(surface.faces, vertex_count, &pairs));
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
PennerMap map_padded(const Component& component, const CutMaker& make_cut) {
  const mesh::Surface& given = component.surface;
  const std::vector<Index>& cones = component.cones;
  ExecutionContext& context = component.context;
  const Stopwatch watch;
  AdmissibleCut cut;
  const Eigen::RowVector3d place = place_of(given);
  const mesh::Surface surface{given.vertices.rowwise() - place, given.faces};
  {
    const ProgressRange range(context, 0.0, 0.1);
    cut = make_cut(surface, cones, component.faces, context);
    require_sound(cut.surface, context);
  }
  const Eigen::Index own_count = surface.vertices.rows();
  const double seconds_cut = watch.seconds();
  std::vector<Index> all = cones;
  all.resize(at(cut.surface.vertices.rows()), 4);
  PennerOptions own = component.options;
  own.uncuttable = edges_left(own.uncuttable, cut.surface);
  PennerMap result;
  try {
    const ProgressRange range(context, 0.1, 1.0);
    PennerMetric metric;
    if (cut.branches.empty()) {
      metric = compute_penner_metric(cut.surface, all, {}, own, context);
    } else {
      metric =
          finish_penner_metric(cut.surface, all, padded_metric(cut, all, context), own, context);
    }
    result = map_from_metric(cut.surface, all, std::move(metric), own, context);
  } catch (const NotConverged&) {
    std::vector<VertexId> vertices(at(own_count));
    std::iota(vertices.begin(), vertices.end(), VertexId{0});
    rethrow_placed(cut.provenance.face, vertices);
  }
  certify::Parametrization& map = result.map;
  result.cones = cones;
  name_input_places(surface, cut.provenance, cut.surface.faces, map);
  map.surface.vertices.rowwise() += place;
  map.surface.vertices.topRows(own_count) = given.vertices;
  certify::CertifyRequest request;
  request.cone_angles = prescribed_angles(cones, given, false);
  certify::certify_map(map, given, request, context);
  map.stats["seconds_cut"] = seconds_cut;
  map.stats["added_vertices"] = static_cast<std::int64_t>(map.surface.vertices.rows() - own_count);
  return result;
}

}  // namespace

PennerMap compute_padding_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                              const CutMaker& make_cut, const PennerOptions& options,
                              ExecutionContext& context) {
  const ComponentMapper map_one = [&](const Component& component) {
    return map_padded(component, make_cut);
  };
  PennerMap found = map_each_component(surface, cones, std::nullopt, options, map_one, context);
  found.map.stats["engine"] = std::string("padding");
  return found;
}

}  // namespace flipfree::seamless
