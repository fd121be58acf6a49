#include "flipfree/intrinsic/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/symmetric_flips.h"

namespace flipfree::intrinsic {

namespace {

constexpr std::int64_t kMostCrossings = std::int64_t{1} << 60;

}  // namespace

OverlayCoordinates::OverlayCoordinates(FlipMesh mesh)
    : input_(std::move(mesh)),
      current_(input_),
      crossings_(input_.next.size(), -1),
      roundabout_(input_.next.size(), 0),
      star_(at(count_vertices(input_)), [&](const auto& add) {
        for (HalfedgeId h = 0; at(h) < input_.halfedge_count(); ++h) add(input_.origin_of(h), h);
      }) {
  for (VertexId v = 0; v < star_.size(); ++v) {
    const std::span<HalfedgeId> star = star_[v];
    const HalfedgeId first = star.front();
    HalfedgeId h = first;
    Index place = 0;
    do {
      star[at(place)] = h;
      roundabout_[at(h)] = place++;
      h = input_.rotate_ccw(h);
    } while (h != first);
    if (at(place) != star.size()) {
      throw InternalError("overlay: the half-edges out of vertex " + std::to_string(v) +
                          " are not one cycle");
    }
  }
}

CornerCounts OverlayCoordinates::corner(HalfedgeId h) const {
  const HalfedgeId n = current_.next_of(h), p = current_.next_of(n);
  const std::int64_t a = crossings(h), b = crossings(p), c = crossings(n);
  return {emanating(a, b, c), turning(a, b, c)};
}

// The roundabout of the half-edge that follows h counter-clockwise, from those of h.
Index OverlayCoordinates::roundabout_after(HalfedgeId h) const {
  const std::int64_t between = corner(h).emanating + (shared(h) ? 1 : 0);
  const std::int64_t place = roundabout(h) + between;
  return static_cast<Index>(place % std::ssize(star_[current_.origin_of(h)]));
}

void OverlayCoordinates::flip(HalfedgeId h) {
  const HalfedgeId o = current_.opposite(h);
  const HalfedgeId hn = current_.next_of(h), hp = current_.next_of(hn);
  const HalfedgeId on = current_.next_of(o), op = current_.next_of(on);
  const FlippedCrossings kl = after_flip(
      {crossings(h), crossings(hn), crossings(hp), crossings(on), crossings(op), shared(h)});
  if (kl.count > kMostCrossings) {
    throw InternalError("overlay: an edge is crossed more than 2^60 times");
  }

  flip_edge(current_, h >> 1);
  crossings_[at(h)] = crossings_[at(o)] = kl.along ? -1 : kl.count;
  // Counter-clockwise around l: op, h, opposite(on); around k: hp, o, opposite(hn).
  roundabout_[at(h)] = roundabout_after(op);
  roundabout_[at(o)] = roundabout_after(hp);
}

namespace {

[[noreturn]] void broken(HalfedgeId g, const char* what) {
  throw InternalError("overlay: input half-edge " + std::to_string(g) + " " + what);
}

// For every half-edge of M0 where it starts in T.
std::vector<CurveStart> find_starts(const OverlayCoordinates& coordinates) {
  const FlipMesh& mesh = coordinates.current();
  std::vector<CurveStart> start(mesh.halfedge_count());
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
    const VertexId v = mesh.origin_of(h);
    const std::span<const HalfedgeId> star = coordinates.star(v);
    std::size_t place = at(coordinates.roundabout(h));
    const auto assign = [&](std::int32_t rank) {
      CurveStart& s = start[at(star[place])];
      if (s.halfedge != kInvalid) broken(star[place], "starts in two corners");
      s = {h, rank};
      place = place + 1 == star.size() ? 0 : place + 1;
    };
    if (coordinates.shared(h)) assign(-1);
    const std::int64_t count = coordinates.corner(h).emanating;
    if (count > std::ssize(star)) broken(star[place], "starts in a corner with too many others");
    for (std::int32_t i = 0; i < count; ++i) assign(i);
  }
  return start;
}

// Position of a curve on half-edge `through`, counted from its source; moves it into the next face.
// Returns false if the curve ends at the vertex opposite to `through` there.
bool advance(const OverlayCoordinates& coordinates, HalfedgeId& through, std::int64_t& position) {
  const FlipMesh& mesh = coordinates.current();
  const HalfedgeId o = FlipMesh::opposite(through);
  const std::int64_t from_source = coordinates.crossings(o) - 1 - position;
  const HalfedgeId on = mesh.next_of(o), op = mesh.next_of(on);
  const std::int64_t turning = coordinates.corner(o).turning;
  if (from_source < turning) {
    through = op;
    position = coordinates.crossings(op) - 1 - from_source;
    return true;
  }
  if (from_source < turning + coordinates.corner(op).emanating) return false;
  through = on;
  position = coordinates.crossings(o) - 1 - from_source;
  return true;
}

}  // namespace

OverlayTrace trace_overlay(const OverlayCoordinates& coordinates, std::vector<HalfedgeId> curves,
                           std::int64_t max_crossings, const ExecutionContext& context) {
  const FlipMesh& mesh = coordinates.current();
  OverlayTrace trace;
  trace.start = find_starts(coordinates);
  trace.curves = std::move(curves);
  trace.begin.reserve(trace.curves.size() + 1);
  trace.begin.push_back(0);
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    if (c % 4096 == 0) context.check();
    const HalfedgeId g = trace.curves[c];
    const CurveStart& s = trace.start[at(g)];
    if (s.halfedge == kInvalid) broken(g, "starts nowhere");
    if (!s.shared()) {
      HalfedgeId through = mesh.next_of(s.halfedge);
      std::int64_t position = coordinates.crossings(s.halfedge) + s.place;
      do {
        if (static_cast<std::int64_t>(trace.crossings.size()) >= max_crossings) {
          throw_not_converged(
              ErrorCode::kIterationLimit,
              "The common refinement of input and final triangulation has more than " +
                  std::to_string(max_crossings) +
                  " crossings. Use a finer or better shaped mesh, or milder target angles.");
        }
        if (trace.crossings.size() % 65536 == 65535) context.check();
        trace.crossings.push_back(
            {through, through % 2 == 0 ? position : coordinates.crossings(through) - 1 - position});
      } while (advance(coordinates, through, position));
      const HalfedgeId apex = mesh.previous(FlipMesh::opposite(through));
      if (mesh.origin_of(apex) != coordinates.input().origin_of(FlipMesh::opposite(g))) {
        broken(g, "does not end at its target");
      }
    }
    trace.begin.push_back(static_cast<std::int64_t>(trace.crossings.size()));
  }
  return trace;
}

namespace {

// Penner lengths from one end of a curve to the two ends of the half-edge it crosses.
struct Reach {
  long double source = 0;
  long double target = 0;
};

Between normalised(long double source, long double target) {
  // Divide by the larger first: the weights themselves may be near the ends of the range.
  const long double largest = std::max(source, target);
  const long double a = source / largest, b = target / largest;
  return {static_cast<double>(a / (a + b)), static_cast<double>(b / (a + b))};
}

}  // namespace

OverlayPositions locate_crossings(const OverlayCoordinates& coordinates, const OverlayTrace& trace,
                                  const std::vector<long double>& lengths,
                                  const std::vector<long double>& scale,
                                  const ExecutionContext& context) {
  const FlipMesh& mesh = coordinates.current();
  const auto length = [&](HalfedgeId h) { return lengths[at(h >> 1)]; };
  OverlayPositions positions;
  positions.on_edge.resize(trace.crossings.size());
  positions.on_curve.resize(trace.crossings.size());
  positions.log_weight.resize(trace.crossings.size());
  // From the start of a curve to the ends of each half-edge that it crosses, in order.
  const auto reach = [&](std::size_t count, const auto& through, std::vector<Reach>& reaches) {
    reaches.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const HalfedgeId h = through(i);
      if (i == 0) {
        reaches.push_back({length(mesh.previous(h)), length(mesh.next_of(h))});
        continue;
      }
      // Ptolemy across the half-edge before, whose ends are seen from the other side.
      const HalfedgeId near = FlipMesh::opposite(through(i - 1));
      const HalfedgeId next = mesh.next_of(near), previous = mesh.previous(near);
      const Reach last = reaches.back();
      const long double apex =
          (last.source * length(previous) + last.target * length(next)) / length(near);
      reaches.push_back(h == next ? Reach{last.source, apex} : Reach{apex, last.target});
    }
  };
  const auto locate = [&](std::size_t c, std::vector<Reach>& from_start,
                          std::vector<Reach>& from_end) {
    const auto crossings = trace.of_curve(c);
    if (crossings.empty()) return;
    const std::size_t count = crossings.size();
    reach(
        count, [&](std::size_t i) { return crossings[i].through; }, from_start);
    reach(
        count, [&](std::size_t i) { return FlipMesh::opposite(crossings[count - 1 - i].through); },
        from_end);
    const VertexId a = coordinates.input().origin_of(trace.curves[c]);
    const VertexId b = coordinates.input().origin_of(FlipMesh::opposite(trace.curves[c]));
    const long double ratio = std::exp(scale[at(b)] - scale[at(a)]);
    for (std::size_t i = 0; i < count; ++i) {
      const Reach& behind = from_start[i];
      const Reach& back = from_end[count - 1 - i];
      const Reach r{back.target, back.source};
      const std::size_t id = static_cast<std::size_t>(trace.begin[c]) + i;
      // Ratios first: products of two lengths may leave even this range.
      const long double across = (behind.source / behind.target) * (r.source / r.target);
      positions.on_edge[id] = normalised(1, across);
      const long double along = (behind.source / r.source) * (behind.target / r.target) * ratio;
      positions.on_curve[id] = normalised(1, along);
      // With ideal points v on the light cone, <v, w> = -|v w|^2 / 2, the place is
      // s exp(-u_a) a + t exp(-u_b) b = weight (on_edge.source c + on_edge.target d).
      const long double whole = length(crossings[i].through);
      const long double by_ends = behind.source / r.source + behind.target / r.target;
      const long double by_edge = (behind.source / whole) * (r.source / whole) +
                                  (behind.target / whole) * (r.target / whole);
      positions.log_weight[id] = static_cast<double>(
          std::log(positions.on_curve[id].source * by_ends * by_edge) - scale[at(a)]);
    }
  };
  constexpr std::size_t kCurvesPerChunk = 4096;
  parallel_for(context, trace.curves.size(), kCurvesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::vector<Reach> from_start, from_end;
                 for (std::size_t c = begin; c < end; ++c) locate(c, from_start, from_end);
               });
  return positions;
}

namespace {

// Areas before and after a replayed flip may differ by so much (relative): else the lengths are not
// trusted.
constexpr long double kAreaTolerance = 1e-9L;

struct Spot {
  long double x = 0, y = 0;
  long double cross(const Spot& b) const { return x * b.y - y * b.x; }
  long double dot(const Spot& b) const { return x * b.x + y * b.y; }
};

// Apex over a side c along the x axis: `a` beside its far end, `b` beside the origin.
Spot apex_over(long double c, long double a, long double b) {
  return {(c + (b - a) * ((b + a) / c)) / 2, quadruple_area(a, b, c) / (2 * c)};
}

// Euclidean lengths on the Delaunay start.
class StartLengths {
 public:
  StartLengths(const FlippedMetric& metric, const std::vector<long double>& initial_length,
               const ExecutionContext& context)
      : length_(initial_length) {
    FlipMesh mesh = metric.initial;
    replay_flips(metric.flips, 0, metric.euclidean_flips, context,
                 [&](EdgeId e) { flip(mesh, e); });
  }
  bool trusted() const { return trusted_; }
  long double of(HalfedgeId h) const { return length_[at(h >> 1)]; }
  Spot apex(const FlipMesh& mesh, HalfedgeId h) const {
    return apex_over(of(h), of(mesh.next_of(h)), of(mesh.previous(h)));
  }

 private:
  // A flip keeps the area of its two triangles, if they form a convex quadrilateral.
  void flip(FlipMesh& mesh, EdgeId e) {
    const HalfedgeId h = 2 * e;
    const Spot k = apex(mesh, h), m = apex(mesh, h ^ 1);
    const Spot d{k.x - (of(h) - m.x), k.y + m.y};
    const long double before = of(h) * (k.y + m.y);
    flip_edge(mesh, e);
    length_[at(e)] = std::sqrt(d.dot(d));
    const long double after = of(h) * (apex(mesh, h).y + apex(mesh, h ^ 1).y);
    trusted_ = trusted_ && std::abs(after - before) <= kAreaTolerance * before;
  }
  std::vector<long double> length_;
  bool trusted_ = true;
};

// Calls visit(crossings) for each edge that is crossed, with the ids in order along its even
// half-edge.
template <typename Visit>
void for_each_edge(const OverlayTrace& trace, const Visit& visit) {
  Lists<std::size_t> by_edge(trace.start.size() / 2, [&](const auto& add) {
    for (std::size_t i = 0; i < trace.crossings.size(); ++i)
      add(trace.crossings[i].through >> 1, i);
  });
  for (EdgeId e = 0; e < by_edge.size(); ++e) {
    const std::span<std::size_t> ids = by_edge[e];
    std::sort(ids.begin(), ids.end(), [&](std::size_t a, std::size_t b) {
      return trace.crossings[a].position < trace.crossings[b].position;
    });
    if (!ids.empty()) visit(ids);
  }
}

// The straight line over `mesh` that starts so, where it meets what the curve crosses. `ends`:
// scratch.
void follow_line(const FlipMesh& mesh, const StartLengths& lengths, const CurveStart& start,
                 std::span<const Crossing> crossings, std::vector<std::array<Spot, 2>>& ends,
                 StraightCrossing* out) {
  ends.clear();
  // The start lies at the origin, the side before the line on the x axis.
  Spot p{lengths.of(start.halfedge), 0};
  Spot q = lengths.apex(mesh, start.halfedge);
  Spot apex;
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    ends.push_back({p, q});
    const HalfedgeId o = FlipMesh::opposite(crossings[i].through);
    const Spot local = lengths.apex(mesh, o);
    const long double l = lengths.of(o);
    const Spot x{(p.x - q.x) / l, (p.y - q.y) / l};
    apex = {q.x + local.x * x.x - local.y * x.y, q.y + local.x * x.y + local.y * x.x};
    if (i + 1 == crossings.size()) break;
    (crossings[i + 1].through == mesh.next_of(o) ? q : p) = apex;
  }
  const long double whole = apex.dot(apex);
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const auto& [a, b] = ends[i];
    const long double right = -apex.cross(a), left = apex.cross(b), sum = right + left;
    out[i].through = crossings[i].through;
    out[i].on_edge.source = -1.0;
    if (!(right > 0 && left > 0)) continue;
    const Spot hit{(a.x * left + b.x * right) / sum, (a.y * left + b.y * right) / sum};
    const long double along = hit.dot(apex) / whole;
    if (!(along > 0 && along < 1)) continue;
    out[i].on_edge = {static_cast<double>(left / sum), static_cast<double>(right / sum)};
    out[i].on_curve = {static_cast<double>(1 - along), static_cast<double>(along)};
  }
}

Between scaled(const Between& b, long double source, long double target) {
  const long double s = b.source * source, t = b.target * target, sum = s + t;
  return {static_cast<double>(s / sum), static_cast<double>(t / sum)};
}

// `trace`, `positions`: of the final triangulation, of the curves that were followed straight;
// `scale`: u per vertex of the mesh.
class Straightener {
 public:
  Straightener(const FlippedMetric& metric, const OverlayTrace& trace,
               const std::vector<long double>& scale, OverlayPositions& positions,
               const ExecutionContext& context)
      : metric_(metric),
        trace_(trace),
        scale_(scale),
        positions_(positions),
        made_later_(metric.mesh.edge_count(), 0),
        wish_(trace.crossings.size()) {
    replay_flips(metric.flips, metric.euclidean_flips, metric.flips.size(), context,
                 [&](EdgeId e) { made_later_[at(e)] = 1; });
  }

  // Cost: O(#E + crossings log crossings).
  Straightened run(const StraightCurves& straight, const ExecutionContext& context) {
    std::vector<std::size_t> bent;  // curves that are not edges of the Delaunay start
    for (std::size_t c = 0; c < trace_.curves.size(); ++c)
      if (!straight.of_curve(c).empty()) bent.push_back(c);
    constexpr std::size_t kCurvesPerChunk = 1024;
    parallel_for(context, bent.size(), kCurvesPerChunk,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   for (std::size_t i = begin; i < end; ++i)
                     match(bent[i], straight.of_curve(bent[i]));
                 });
    move_on_edges(context);
    for (const std::size_t c : bent) move_on_curve(c);
    return result_;
  }

 private:
  // The same crossings in D and in T: those of edges that both have, in the same order. Different
  // curves may be matched at the same time.
  void match(std::size_t curve, std::span<const StraightCrossing> straight) {
    const auto crossings = trace_.of_curve(curve);
    std::size_t j = 0;
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      const HalfedgeId h = crossings[i].through;
      if (made_later_[at(h >> 1)]) continue;
      while (j < straight.size() && made_later_[at(straight[j].through >> 1)]) ++j;
      if (j == straight.size() || straight[j].through != h) return;
      if (straight[j].on_edge.source > 0.0) {
        const long double us = scale_[at(metric_.mesh.origin[at(h)])];
        const long double ut = scale_[at(metric_.mesh.origin[at(h ^ 1)])];
        // Weights of an edge are divided by the factors of its ends; only the ratio counts.
        const long double most = std::max(us, ut), least = std::min(us, ut);
        Wish& w = wish_[static_cast<std::size_t>(trace_.begin[curve]) + i];
        w.on_edge = scaled(straight[j].on_edge, std::exp(ut - most), std::exp(us - most));
        w.on_curve = straight[j].on_curve;
        w.log_weight =
            static_cast<double>(std::log(straight[j].on_edge.source * std::exp(least - us) +
                                         straight[j].on_edge.target * std::exp(least - ut)) -
                                least);
      }
      ++j;
    }
  }

  // Moves the crossings of every edge whose places are in order.
  void move_on_edges(const ExecutionContext& context) {
    for_each_edge(trace_, [&](std::span<const std::size_t> ids) {
      if (made_later_[at(trace_.crossings[ids.front()].through >> 1)]) return;
      double last = 0.0;
      bool ordered = true;
      for (const std::size_t id : ids) {
        const Between& b = wish_[id].on_edge;
        const double share = trace_.crossings[id].through % 2 == 0 ? b.target : b.source;
        ordered = ordered && b.source > 0.0 && b.target > 0.0 && share > last;
        last = share;
      }
      (ordered ? result_.moved : result_.kept) += ids.size();
      for (std::size_t i = 0; ordered && i < ids.size(); ++i) {
        positions_.on_edge[ids[i]] = wish_[ids[i]].on_edge;
        positions_.log_weight[ids[i]] = wish_[ids[i]].log_weight;
      }
    });
    context.check();
  }

  // Along a curve: known places are taken if they are in order, others keep their share of the way
  // between their neighbours.
  void move_on_curve(std::size_t curve) {
    const auto first = static_cast<std::size_t>(trace_.begin[curve]);
    const auto last = static_cast<std::size_t>(trace_.begin[curve + 1]);
    double reached = 0.0;
    for (std::size_t i = first; i < last; ++i) {
      if (!(wish_[i].on_edge.source > 0.0)) continue;
      if (!(wish_[i].on_curve.target > reached)) return;
      reached = wish_[i].on_curve.target;
    }
    Between old_from{1.0, 0.0}, new_from{1.0, 0.0};
    for (std::size_t i = first; i < last;) {
      std::size_t known = i;
      while (known < last && !(wish_[known].on_edge.source > 0.0)) ++known;
      const Between old_to = known < last ? positions_.on_curve[known] : Between{0.0, 1.0};
      const Between new_to = known < last ? wish_[known].on_curve : Between{0.0, 1.0};
      for (; i < known; ++i) {
        const double span = old_to.target - old_from.target;
        const double share =
            span > 0.0
                ? std::clamp((positions_.on_curve[i].target - old_from.target) / span, 0.0, 1.0)
                : 0.5;
        positions_.on_curve[i] = {(1.0 - share) * new_from.source + share * new_to.source,
                                  (1.0 - share) * new_from.target + share * new_to.target};
      }
      if (known == last) break;
      result_.largest_move =
          std::max(result_.largest_move, std::abs(new_to.target - old_to.target));
      positions_.on_curve[known] = new_to;
      old_from = old_to;
      new_from = new_to;
      i = known + 1;
    }
  }

  struct Wish {
    Between on_edge{-1.0, 0.0}, on_curve;  // a negative source: none
    double log_weight = 0.0;
  };
  const FlippedMetric& metric_;
  const OverlayTrace& trace_;
  const std::vector<long double>& scale_;
  OverlayPositions& positions_;
  std::vector<char> made_later_;  // #E: by a Ptolemy flip
  std::vector<Wish> wish_;
  Straightened result_;
};

// The straight lines of `curves`. `start`: coordinates after the Euclidean flips alone. Cost: O(#E
// + crossings).
StraightCurves follow_straight(const FlippedMetric& metric, const OverlayCoordinates& start,
                               const std::vector<HalfedgeId>& curves,
                               const std::vector<long double>& initial_length,
                               const ExecutionContext& context) {
  StraightCurves out;
  const StartLengths lengths(metric, initial_length, context);
  if (!lengths.trusted()) return out;
  const OverlayTrace trace =
      trace_overlay(start, curves, std::numeric_limits<std::int64_t>::max(), context);
  out.begin = trace.begin;
  out.crossings.resize(trace.crossings.size());
  std::vector<std::array<Spot, 2>> ends;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    if (c % 1024 == 0) context.check();
    const auto crossings = trace.of_curve(c);
    if (crossings.empty()) continue;
    follow_line(start.current(), lengths, trace.start[at(curves[c])], crossings, ends,
                out.crossings.data() + out.begin[c]);
  }
  return out;
}

}  // namespace

Overlay build_overlay(const FlippedMetric& metric, const std::vector<HalfedgeId>& curves,
                      std::int64_t max_crossings, const ExecutionContext& context) {
  debug_check("build_overlay", [&] { return find_broken_invariant(metric); });
  Overlay overlay{OverlayCoordinates(metric.initial), {}, {}, {}};
  const auto replay = [&](std::size_t from, std::size_t to) {
    replay_flips(metric.flips, from, to, context,
                 [&](EdgeId e) { overlay.coordinates.flip(FlipMesh::halfedge(e)); });
  };
  replay(0, metric.euclidean_flips);
  std::optional<OverlayCoordinates> start;
  if (metric.euclidean_flips > 0) start = overlay.coordinates;
  replay(metric.euclidean_flips, metric.flips.size());
  if (overlay.coordinates.current().next != metric.mesh.next) {
    throw InternalError("overlay: the recorded flips do not lead to the final triangulation");
  }
  const std::vector<long double> u = widened(metric.u);
  std::vector<long double> scale;
  scale.reserve(metric.mesh.unknown.size());
  for (const VertexId v : metric.mesh.unknown) scale.push_back(u[static_cast<std::size_t>(v)]);
  StraightCurves straight;
  parallel_for(context, 2, 1, [&](std::size_t task, std::size_t, std::size_t) {
    if (task == 0) {
      overlay.trace = trace_overlay(overlay.coordinates, curves, max_crossings, context);
      overlay.positions = locate_crossings(overlay.coordinates, overlay.trace,
                                           widened(metric.length), scale, context);
    } else if (start) {
      straight = follow_straight(metric, *start, curves, widened(metric.initial_length), context);
    }
  });
  if (!straight.begin.empty()) {
    Straightener straightener(metric, overlay.trace, scale, overlay.positions, context);
    overlay.straightened = straightener.run(straight, context);
  }
  return overlay;
}

namespace {

// The place of the i-th of so many, drawn towards an even spacing; not before `least`, where
// rounding has put the last one.
Between spread(const Between& b, std::size_t i, std::size_t count, double share, double& least) {
  const double even = static_cast<double>(i + 1) / static_cast<double>(count + 1);
  const double target = std::max((1.0 - share) * b.target, least) + share * even;
  least = target - share * even;
  const double rest = (1.0 - share) * b.source + share * (1.0 - even);
  return {std::min(rest, 1.0 - target), target};
}

Between reversed(const Between& b) { return {b.target, b.source}; }

}  // namespace

void spread_crossings(const OverlayTrace& trace, double share, OverlayPositions& positions) {
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    const auto first = static_cast<std::size_t>(trace.begin[c]);
    const auto end = static_cast<std::size_t>(trace.begin[c + 1]);
    double least = 0.0;
    for (std::size_t i = first; i < end; ++i) {
      positions.on_curve[i] = spread(positions.on_curve[i], i - first, end - first, share, least);
    }
  }
  for_each_edge(trace, [&](std::span<const std::size_t> ids) {
    double least = 0.0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      Between& b = positions.on_edge[ids[i]];
      const bool forward = trace.crossings[ids[i]].through % 2 == 0;
      const Between moved = spread(forward ? b : reversed(b), i, ids.size(), share, least);
      b = forward ? moved : reversed(moved);
    }
  });
}

}  // namespace flipfree::intrinsic
