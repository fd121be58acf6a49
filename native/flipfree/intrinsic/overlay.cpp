#include "flipfree/intrinsic/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
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
#include "flipfree/intrinsic/flip_lengths.h"
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
            {through,
             through % 2 == 0 ? position : coordinates.crossings(through) - 1 - position,
             {},
             {},
             0.0});
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

void locate_crossings(const OverlayCoordinates& coordinates,
                      const std::vector<long double>& lengths,
                      const std::vector<long double>& scale, OverlayTrace& trace,
                      const ExecutionContext& context) {
  const FlipMesh& mesh = coordinates.current();
  const auto length = [&](HalfedgeId h) { return lengths[at(h >> 1)]; };
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
    const std::span<Crossing> crossings = trace.of_curve(c);
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
      Crossing& crossing = crossings[i];
      // Ratios first: products of two lengths may leave even this range.
      const long double across = (behind.source / behind.target) * (r.source / r.target);
      crossing.on_edge = normalised(1, across);
      const long double along = (behind.source / r.source) * (behind.target / r.target) * ratio;
      crossing.on_curve = normalised(1, along);
      // With ideal points v on the light cone, <v, w> = -|v w|^2 / 2, the place is
      // s exp(-u_a) a + t exp(-u_b) b = weight (on_edge.source c + on_edge.target d).
      const long double whole = length(crossing.through);
      const long double by_ends = behind.source / r.source + behind.target / r.target;
      const long double by_edge = (behind.source / whole) * (r.source / whole) +
                                  (behind.target / whole) * (r.target / whole);
      crossing.log_weight = static_cast<double>(
          std::log(crossing.on_curve.source * by_ends * by_edge) - scale[at(a)]);
    }
  };
  constexpr std::size_t kCurvesPerChunk = 4096;
  parallel_for(context, trace.curves.size(), kCurvesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::vector<Reach> from_start, from_end;
                 for (std::size_t c = begin; c < end; ++c) locate(c, from_start, from_end);
               });
}

namespace {

// Areas before and after a replayed flip may differ by so much (relative): else the lengths are not
// trusted.
constexpr long double kAreaTolerance = 1e-9L;

using Spot = std::complex<long double>;
long double dot_product(const Spot& a, const Spot& b) { return (std::conj(a) * b).real(); }
long double cross_product(const Spot& a, const Spot& b) { return (std::conj(a) * b).imag(); }

// With Kahan's height: without it, one needle would cost all lengths their trust.
Spot apex_over(const FlipMesh& mesh, const std::vector<long double>& length, HalfedgeId h) {
  const auto of = [&](HalfedgeId side) { return length[at(side >> 1)]; };
  const long double a = of(mesh.next_of(h)), b = of(mesh.previous(h)), c = of(h);
  return {(c + (b - a) * ((b + a) / c)) / 2, quadruple_area(a, b, c) / (2 * c)};
}

// Euclidean lengths on the Delaunay start; none if they cannot be trusted: a flip keeps the area of
// its two triangles, if they form a convex quadrilateral.
std::vector<long double> start_lengths(const FlippedMetric& metric,
                                       const ExecutionContext& context) {
  std::vector<long double> length = widened(metric.initial_length);
  FlipMesh mesh = metric.initial;
  bool trusted = true;
  // From the apex on the right to the one on the left.
  const auto between = [&](EdgeId e) {
    const Spot left = apex_over(mesh, length, 2 * e), right = apex_over(mesh, length, 2 * e + 1);
    return Spot(left.real() - (length[at(e)] - right.real()), left.imag() + right.imag());
  };
  replay_flips(metric.flips, 0, metric.euclidean_flips, context, [&](EdgeId e) {
    const Spot diagonal = between(e);
    const long double before = length[at(e)] * diagonal.imag();
    length[at(e)] = std::hypot(diagonal.real(), diagonal.imag());
    flip_edge(mesh, e);
    const long double after = length[at(e)] * between(e).imag();
    trusted = trusted && std::abs(after - before) <= kAreaTolerance * before;
  });
  if (!trusted) length.clear();
  return length;
}

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

constexpr Between kNowhere{-1.0, 0.0};  // a place that is not known

// Gives the crossings of a curve the places where the straight line over `mesh` that starts so
// meets them; kNowhere on the edge if that is lost in rounding. `ends`: scratch.
void follow_line(const FlipMesh& mesh, const std::vector<long double>& length,
                 const CurveStart& start, std::span<Crossing> crossings,
                 std::vector<std::array<Spot, 2>>& ends) {
  if (crossings.empty()) return;
  ends.clear();
  // The start lies at the origin, the side before the line on the x axis.
  Spot p = length[at(start.halfedge >> 1)];
  Spot q = apex_over(mesh, length, start.halfedge);
  Spot apex;
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    ends.push_back({p, q});
    const HalfedgeId o = FlipMesh::opposite(crossings[i].through);
    apex = q + apex_over(mesh, length, o) * ((p - q) / length[at(o >> 1)]);
    if (i + 1 == crossings.size()) break;
    (crossings[i + 1].through == mesh.next_of(o) ? q : p) = apex;
  }
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const auto& [a, b] = ends[i];
    const long double right = -cross_product(apex, a), left = cross_product(apex, b);
    const long double sum = right + left;
    crossings[i].on_edge = kNowhere;
    if (!(right > 0 && left > 0)) continue;
    const long double along =
        dot_product((a * left + b * right) / sum, apex) / dot_product(apex, apex);
    if (!(along > 0 && along < 1)) continue;
    crossings[i].on_edge = {static_cast<double>(left / sum), static_cast<double>(right / sum)};
    crossings[i].on_curve = {static_cast<double>(1 - along), static_cast<double>(along)};
  }
}

// The straight lines of `curves` over D, no curve if lengths cannot be trusted. `start`:
// coordinates after the Euclidean flips alone. Cost: O(#E + crossings).
OverlayTrace follow_straight(const FlippedMetric& metric, const OverlayCoordinates& start,
                             const std::vector<HalfedgeId>& curves,
                             const ExecutionContext& context) {
  const std::vector<long double> length = start_lengths(metric, context);
  if (length.empty()) return {};
  OverlayTrace trace =
      trace_overlay(start, curves, std::numeric_limits<std::int64_t>::max(), context);
  std::vector<std::array<Spot, 2>> ends;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    if (c % 1024 == 0) context.check();
    follow_line(start.current(), length, trace.start[at(curves[c])], trace.of_curve(c), ends);
  }
  return trace;
}

Between scaled(const Between& b, long double source, long double target) {
  const long double s = b.source * source, t = b.target * target, sum = s + t;
  return {static_cast<double>(s / sum), static_cast<double>(t / sum)};
}

// Places in T of the crossings of a curve that D has as well: those of edges that both have, in the
// same order. `made_later`: flags of edges, by a Ptolemy flip; `scale`: u per vertex of T.
void carry_places(const FlipMesh& mesh, const std::vector<char>& made_later,
                  const std::vector<long double>& scale, std::span<const Crossing> straight,
                  std::span<const Crossing> crossings, std::span<Crossing> places) {
  std::size_t j = 0;
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const HalfedgeId h = crossings[i].through;
    if (made_later[at(h >> 1)]) continue;
    while (j < straight.size() && made_later[at(straight[j].through >> 1)]) ++j;
    if (j == straight.size() || straight[j].through != h) return;
    const auto& [source, target] = straight[j].on_edge;
    if (source > 0.0) {
      // Weights of an edge are divided by the factors of its ends; only the ratio counts.
      const long double us = scale[at(mesh.origin_of(h))], ut = scale[at(mesh.target(h))];
      const long double most = std::max(us, ut), least = std::min(us, ut);
      places[i].on_edge = scaled(straight[j].on_edge, std::exp(ut - most), std::exp(us - most));
      places[i].on_curve = straight[j].on_curve;
      places[i].log_weight = static_cast<double>(
          std::log(source * std::exp(least - us) + target * std::exp(least - ut)) - least);
    }
    ++j;
  }
}

// Moves the crossings of an edge to their places, if these are in order; were they?
bool move_on_edge(std::span<const std::size_t> ids, const std::vector<Crossing>& places,
                  OverlayTrace& trace) {
  double last = 0.0;
  for (const std::size_t id : ids) {
    const Between& b = places[id].on_edge;
    const double share = trace.crossings[id].through % 2 == 0 ? b.target : b.source;
    if (!(b.source > 0.0 && b.target > 0.0 && share > last)) return false;
    last = share;
  }
  for (const std::size_t id : ids) {
    trace.crossings[id].on_edge = places[id].on_edge;
    trace.crossings[id].log_weight = places[id].log_weight;
  }
  return true;
}

// Along a curve: known places are taken if they are in order, others keep their share of the way
// between their neighbours. The largest move.
double move_on_curve(std::span<const Crossing> places, std::span<Crossing> crossings) {
  double reached = 0.0;
  for (const Crossing& place : places) {
    if (!(place.on_edge.source > 0.0)) continue;
    if (!(place.on_curve.target > reached)) return 0.0;
    reached = place.on_curve.target;
  }
  double largest = 0.0;
  Between old_from{1.0, 0.0}, new_from{1.0, 0.0};
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    std::size_t known = i;
    while (known < crossings.size() && !(places[known].on_edge.source > 0.0)) ++known;
    const bool end = known == crossings.size();
    const Between old_to = end ? Between{0.0, 1.0} : crossings[known].on_curve;
    const Between new_to = end ? Between{0.0, 1.0} : places[known].on_curve;
    for (; i < known; ++i) {
      const double span = old_to.target - old_from.target;
      const double share =
          span > 0.0 ? std::clamp((crossings[i].on_curve.target - old_from.target) / span, 0.0, 1.0)
                     : 0.5;
      crossings[i].on_curve = {(1.0 - share) * new_from.source + share * new_to.source,
                               (1.0 - share) * new_from.target + share * new_to.target};
    }
    if (end) break;
    largest = std::max(largest, std::abs(new_to.target - old_to.target));
    crossings[known].on_curve = new_to;
    old_from = old_to;
    new_from = new_to;
  }
  return largest;
}

// Moves crossings to the places that straight lines over D say. `straight`: of the same curves.
// Cost: O(#E + crossings log crossings).
Straightened straighten(const FlippedMetric& metric, const OverlayTrace& straight,
                        const std::vector<long double>& scale, OverlayTrace& trace,
                        const ExecutionContext& context) {
  Straightened result;
  std::vector<char> made_later(metric.mesh.edge_count(), 0);
  replay_flips(metric.flips, metric.euclidean_flips, metric.flips.size(), context,
               [&](EdgeId e) { made_later[at(e)] = 1; });
  std::vector<std::size_t> bent;  // curves that are not edges of the Delaunay start
  for (std::size_t c = 0; c < trace.curves.size(); ++c)
    if (!straight.of_curve(c).empty()) bent.push_back(c);
  std::vector<Crossing> places(trace.crossings.size(), {kInvalid, 0, kNowhere, {}, 0.0});
  const auto places_of = [&](std::size_t c) {
    return std::span(places).subspan(at(trace.begin[c]), at(trace.begin[c + 1] - trace.begin[c]));
  };
  constexpr std::size_t kCurvesPerChunk = 1024;
  parallel_for(context, bent.size(), kCurvesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (const std::size_t c : std::span(bent).subspan(begin, end - begin))
                   carry_places(metric.mesh, made_later, scale, straight.of_curve(c),
                                std::as_const(trace).of_curve(c), places_of(c));
               });
  for_each_edge(trace, [&](std::span<const std::size_t> ids) {
    if (made_later[at(trace.crossings[ids.front()].through >> 1)]) return;
    (move_on_edge(ids, places, trace) ? result.moved : result.kept) += ids.size();
  });
  context.check();
  for (const std::size_t c : bent)
    result.largest_move =
        std::max(result.largest_move, move_on_curve(places_of(c), trace.of_curve(c)));
  return result;
}

}  // namespace

Overlay build_overlay(const FlippedMetric& metric, const std::vector<HalfedgeId>& curves,
                      std::int64_t max_crossings, const ExecutionContext& context) {
  debug_check("build_overlay", [&] { return find_broken_invariant(metric); });
  Overlay overlay{OverlayCoordinates(metric.initial), {}, {}};
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
  OverlayTrace straight;
  parallel_for(context, 2, 1, [&](std::size_t task, std::size_t, std::size_t) {
    if (task == 0) {
      overlay.trace = trace_overlay(overlay.coordinates, curves, max_crossings, context);
      locate_crossings(overlay.coordinates, widened(metric.length), scale, overlay.trace, context);
    } else if (start) {
      straight = follow_straight(metric, *start, curves, context);
    }
  });
  if (!straight.begin.empty())
    overlay.straightened = straighten(metric, straight, scale, overlay.trace, context);
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

void spread_crossings(double share, OverlayTrace& trace) {
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    const std::span<Crossing> crossings = trace.of_curve(c);
    double least = 0.0;
    for (std::size_t i = 0; i < crossings.size(); ++i)
      crossings[i].on_curve = spread(crossings[i].on_curve, i, crossings.size(), share, least);
  }
  for_each_edge(trace, [&](std::span<const std::size_t> ids) {
    double least = 0.0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      Crossing& crossing = trace.crossings[ids[i]];
      const bool forward = crossing.through % 2 == 0;
      const Between& b = crossing.on_edge;
      const Between moved = spread(forward ? b : reversed(b), i, ids.size(), share, least);
      crossing.on_edge = forward ? moved : reversed(moved);
    }
  });
}

}  // namespace flipfree::intrinsic
