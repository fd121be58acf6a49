#include "flipfree/intrinsic/layout/layout.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/stats.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {
namespace {

// Laying the final flat metric out in the plane, along the edges of the user's own triangulation:
// every corner of an input face and every crossing of an input edge with the final triangulation
// gets its place.
//
// The surface is developed input face by input face, the largest first (a spanning tree of the
// uncut dual over long developed edges), so that errors of large triangles do not pass through
// small ones. Directions are carried as unit vectors beside positions: a small triangle far from
// the origin keeps its shape until the last addition.
//
// Guarantee: away from cuts neighbouring faces get equal places bit for bit; across a cut the two
// sides differ by a rigid motion up to the angle error of the metric.

// A place in the plane; 80-bit numbers for their range. Squares stay in it, so no scaling is
// needed.
using Place = std::complex<long double>;

// By the package's own mathematics, which has no cabsl and no cargl.
long double length(const Place& p) { return std::hypot(p.real(), p.imag()); }

// The development of a triangulation: places of its corners, and of points along its edges.
//
// On the input's own triangulation the points are where its edges cross the final one. On a
// refined start (split_surface.h) every edge of the input is a chain of pieces with crossings of
// their own, joined by added vertices: these become points of the edge like the others. Vertices
// added inside faces are not needed: a face's image is known from its boundary.
struct Development {
  struct Point {
    Between along;                // between the ends of its edge
    std::array<Place, 2> places;  // left and right of the edge; equal away from cuts
  };
  std::vector<Place> corner;         // 3 #F
  std::vector<double> corner_angle;  // 3 #F: angle between the first pieces of a corner's two
                                     // sides, may pass 2 pi; 0 in faces without crossings
  std::vector<std::int64_t> begin;   // #E + 1: points of edge e, in order along its half-edge
  std::vector<Point> points;
  std::vector<Index> chart_of_face;  // #F
  Index chart_count = 0;
  // Largest distance between two developments of one place, over the largest developed edge: how
  // well the flat metric closes.
  double closing_error = 0.0;
};

// The crossings of an edge, along it or back.
struct Crossings {
  std::int64_t begin, end;
  bool forward;
  Crossings(const MetricOverlay& overlaid, EdgeId edge, bool along)
      : begin(overlaid.overlay.trace.begin[at(edge)]),
        end(overlaid.overlay.trace.begin[at(edge) + 1]),
        forward(along) {}
  std::int64_t count() const { return end - begin; }
  std::size_t id(std::int64_t i) const { return at(forward ? begin + i : end - 1 - i); }
  // A place between the ends of the curve, or of what it crosses, as seen from there.
  Between seen(const Between& b) const { return forward ? b : Between{b.target, b.source}; }
};

// Longest edge over shortest up to which double is enough: a thousand roundings of the largest
// place are then 1e-7 of the shortest edge. And fourth powers of lengths must be representable.
constexpr double kMildRatio = 1 << 20;
constexpr double kLargestMild = 1e60;

// A half-edge of T in the plane: place of its source, unit direction.
template <typename Real>
struct Frame {
  Real x{0.0}, y{0.0}, dx{1.0}, dy{0.0};
};

template <typename Real>
struct Angle {
  Real cosine{1.0}, sine{0.0};
};

// Follows the half-edges of the user's triangulation M0 through the triangles of the final one, T,
// in the plane. A frame says where a half-edge of T lies: the place of its source and its
// direction. From the frame at one end of a half-edge of M0 that at its other end follows, and from
// there, turning around the vertex, that of the next half-edge of M0.
template <typename Real>
class FaceDeveloper {
 public:
  // Along `cuts` (flags of M0's half-edges) neighbours part.
  FaceDeveloper(const MetricOverlay& overlaid, const mesh::EdgeFlags& cuts,
                std::vector<Real> lengths, const ExecutionContext& context)
      : overlaid_(overlaid),
        trace_(overlaid.overlay.trace),
        mesh_(overlaid.overlay.coordinates.current()),
        halfedges_(overlaid.metric->input_halfedge),
        context_(context),
        lengths_(std::move(lengths)),
        angles_(mesh_.halfedge_count()),
        curve_(mesh_.edge_count(), kInvalid),
        mate_(overlaid.adjacency.opposite),
        placed_(halfedges_.size(), 0) {
    parallel_for(context, angles_.size(), 4096,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   for (std::size_t h = begin; h < end; ++h)
                     angles_[h] = corner_angle(static_cast<HalfedgeId>(h));
                 });
    for (CornerId c = 0; c < corner_count(); ++c) {
      curve_[at(halfedge(c) >> 1)] = overlaid.edges.of_corner[at(c)];
      if (cuts[at(c)]) mate_[at(c)] = kInvalid;
    }
    development_.corner.resize(halfedges_.size());
    development_.begin = trace_.begin;
    development_.points.reserve(trace_.crossings.size());
    for (const Crossing& crossing : trace_.crossings)
      development_.points.push_back({crossing.on_curve, {}});
    development_.chart_of_face.assign(halfedges_.size() / 3, kInvalid);
  }

  Development run() {
    for (const FaceId root : faces_by_size()) {
      if (is_done(root)) continue;
      place_root(root);
      while (!fronts_.empty()) place_next();
      ++development_.chart_count;
    }
    measure_angles();
    development_.closing_error =
        largest_ > 0 ? static_cast<double>(std::sqrt(gap_ / largest_)) : 0.0;
    return std::move(development_);
  }

 private:
  using F = Frame<Real>;
  // An uncut input edge over which the next face may be developed: frames of start(g) and
  // start(opposite(g)), g the half-edge of the corner in the face to be entered.
  struct EdgeFrames {
    F at_source, at_target;
  };

  const CurveStart& start(HalfedgeId g) const { return trace_.start[at(g)]; }
  Place place(const F& f) const { return {numeric::widen(f.x), numeric::widen(f.y)}; }
  long double length(HalfedgeId h) const { return numeric::widen(lengths_[at(h >> 1)]); }
  Crossings crossings_of(HalfedgeId g) const {
    const Index curve = curve_[at(g >> 1)];
    return {overlaid_, curve, trace_.curves[at(curve)] == g};
  }

  // From the frame of start(from) to that of start(to), the next half-edge of M0 around their
  // source, counter-clockwise or clockwise.
  F rotate(F frame, HalfedgeId from, HalfedgeId to, bool ccw) const {
    const CurveStart &a = start(from), &b = start(to);
    if (a.halfedge == b.halfedge && (ccw ? b.place > a.place : b.place < a.place)) return frame;
    HalfedgeId h = a.halfedge;
    for (std::size_t guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
      if (!ccw) h = mesh_.next_of(FlipMesh::opposite(h));
      const Angle<Real>& angle = angles_[at(h)];
      turn(frame, angle.cosine, ccw ? angle.sine : -angle.sine);
      if (ccw) h = mesh_.rotate_ccw(h);
      if (h == b.halfedge) return frame;
    }
    throw InternalError("layout: input half-edge " + std::to_string(to) +
                        " was not found around its source");
  }

  // Angle from the first piece of half-edge `from` of M0 counter-clockwise to that of `to`, the
  // next one around.
  double angle_between(HalfedgeId from, HalfedgeId to) const {
    const CurveStart &a = start(from), &b = start(to);
    double sum = offset(to) - offset(from);
    if (a.halfedge == b.halfedge && b.place > a.place) return sum;
    HalfedgeId h = a.halfedge;
    do {
      const Angle<Real>& angle = angles_[at(h)];
      sum += std::atan2(static_cast<double>(numeric::widen(angle.sine)),
                        static_cast<double>(numeric::widen(angle.cosine)));
      h = mesh_.rotate_ccw(h);
    } while (h != b.halfedge);
    return sum;
  }

  // Follows half-edge g of M0, no edge of T, from the frame of start(g) to that of
  // start(opposite(g)). Calls visit(crossing id, place) in order along g.
  template <typename Visit>
  F follow(F frame, HalfedgeId g, const Visit& visit) const {
    const Crossings crossings = crossings_of(g);
    HalfedgeId h = start(g).halfedge;
    for (std::int64_t i = 0; i < crossings.count(); ++i) {
      const std::size_t id = crossings.id(i);
      // Against the curve's own direction it is the opposite half-edge through which a face is
      // left.
      const HalfedgeId recorded = trace_.crossings[id].through;
      const HalfedgeId through = crossings.forward ? recorded : FlipMesh::opposite(recorded);
      for (int k = 0; h != through; ++k) {
        if (k == 3)
          throw InternalError("layout: input half-edge " + std::to_string(g) +
                              " jumps between faces");
        to_next(frame, h);
      }
      const Real t(crossings.seen(trace_.crossings[id].on_edge).target);
      const Real& l = lengths_[at(h >> 1)];
      visit(id, Place{numeric::widen(frame.x + frame.dx * l * t),
                      numeric::widen(frame.y + frame.dy * l * t)});
      to_opposite(frame, h);
    }
    to_next(frame, h);
    to_next(frame, h);
    if (h != start(FlipMesh::opposite(g)).halfedge) {
      throw InternalError("layout: input half-edge " + std::to_string(g) +
                          " ends in the wrong corner");
    }
    return frame;
  }

  // Angle from the half-edge of T at which half-edge g of M0 starts to g's first piece.
  double offset(HalfedgeId g) const {
    const CurveStart& s = start(g);
    if (s.shared()) return 0.0;
    const Crossings crossings = crossings_of(g);
    // The opposite side runs from the target of h; seen against the curve its ends are swapped.
    const Between near = crossings.seen(trace_.crossings[crossings.id(0)].on_edge);
    const Angle<Real>& angle = angles_[at(s.halfedge)];
    const long double a = length(s.halfedge) * near.source;
    const long double b = length(mesh_.previous(s.halfedge)) * near.target;
    return static_cast<double>(
        std::atan2(b * numeric::widen(angle.sine), a + b * numeric::widen(angle.cosine)));
  }
  static void turn(F& f, const Real& c, const Real& s) {
    const Real x = f.dx * c - f.dy * s;
    f.dy = f.dx * s + f.dy * c;
    f.dx = x;
  }
  void to_target(F& f, HalfedgeId h) const {
    const Real& l = lengths_[at(h >> 1)];
    f.x = f.x + f.dx * l;
    f.y = f.y + f.dy * l;
  }
  // The frame of h becomes that of the next half-edge, or of the opposite one, and so does h.
  void to_next(F& f, HalfedgeId& h) const {
    to_target(f, h);
    h = mesh_.next_of(h);
    turn(f, -angles_[at(h)].cosine, angles_[at(h)].sine);  // by pi - angle
  }
  void to_opposite(F& f, HalfedgeId& h) const {
    to_target(f, h);
    h = FlipMesh::opposite(h);
    f.dx = -f.dx;
    f.dy = -f.dy;
  }
  // The angle at the source of h in its face, by half-angle formulas that keep small angles
  // relatively accurate.
  Angle<Real> corner_angle(HalfedgeId h) const {
    using std::sqrt;
    const Real& a = lengths_[at(h >> 1)];
    const Real& b = lengths_[at(mesh_.previous(h) >> 1)];
    const Real& c = lengths_[at(mesh_.next_of(h) >> 1)];
    const Real zero(0.0), two(2.0);
    const auto positive = [&](const Real& x) { return x > zero ? x : zero; };
    const Real p =
        (a > b) ? positive(c - (a - b)) * (c + (a - b)) : positive(c - (b - a)) * (c + (b - a));
    const Real q = positive((a + b) - c) * ((a + b) + c);
    // tan^2(angle / 2) = p / q; cos = (q - p) / (q + p), sin = 2 sqrt(p q) / (p + q).
    const Real sum = p + q;
    if (!(sum > zero)) return {};
    const Real inverse = Real(1.0) / sum;
    return {(q - p) * inverse, two * sqrt(p * q) * inverse};
  }

  Index corner_count() const { return static_cast<Index>(halfedges_.size()); }
  HalfedgeId halfedge(CornerId c) const { return halfedges_[at(c)]; }
  HalfedgeId opposite(CornerId c) const { return FlipMesh::opposite(halfedge(c)); }
  // The corner whose half-edge is opposite to that of c; kInvalid at cuts.
  CornerId mate(CornerId c) const { return mate_[at(c)]; }
  bool is_done(FaceId f) const { return development_.chart_of_face[at(f)] != kInvalid; }
  // Is the edge of this corner placed already, from its other side?
  bool known(CornerId c) const { return mate(c) != kInvalid && is_done(mate(c) / 3); }

  // The face with the longest final edge goes first, in every chart.
  std::vector<FaceId> faces_by_size() const {
    std::vector<long double> size(halfedges_.size() / 3, 0);
    for (CornerId c = 0; c < corner_count(); ++c)
      size[at(c / 3)] = std::max(size[at(c / 3)], length(start(halfedge(c)).halfedge));
    std::vector<FaceId> faces(size.size());
    std::iota(faces.begin(), faces.end(), 0);
    std::stable_sort(faces.begin(), faces.end(),
                     [&](FaceId a, FaceId b) { return size[at(a)] > size[at(b)]; });
    return faces;
  }

  // The first edge of the root face lies along the x axis at its start.
  void place_root(FaceId root) {
    development_.chart_of_face[at(root)] = development_.chart_count;
    place_face(3 * root, {F{}, develop_edge(3 * root, F{}, false)});
  }

  void place_next() {
    constexpr Index kFacesPerCheck = 1024;
    const auto front = fronts_.extract(fronts_.begin());
    const CornerId c = front.key().second;
    if (is_done(c / 3)) return;
    development_.chart_of_face[at(c / 3)] = development_.chart_count;
    if (++done_ % kFacesPerCheck == 0) context_.check();
    place_face(c, front.mapped());
  }

  // The face of c, whose half-edge lies so.
  void place_face(CornerId c, const EdgeFrames& edge) {
    const CornerId n = next_corner(c), p = previous_corner(c);
    settle(c, place(edge.at_source));
    settle(n, place(edge.at_target));
    const F left = rotate(edge.at_source, halfedge(c), opposite(p), true);
    const F right = rotate(edge.at_target, opposite(c), halfedge(n), false);
    if (!known(n)) settle(p, place(develop_edge(n, right, false)));
    if (!known(p)) settle(p, place(develop_edge(p, left, true)));
  }

  // Gives every corner of the uncut fan around `c` this place, unless one has it already.
  void settle(CornerId c, const Place& p) {
    if (placed_[at(c)] != 0) {
      gap_ = std::max(gap_, std::norm(development_.corner[at(c)] - p));
      return;
    }
    const auto set = [&](CornerId d) {
      development_.corner[at(d)] = p;
      placed_[at(d)] = 1;
    };
    set(c);
    CornerId d = c;
    while ((d = mate(previous_corner(d))) != kInvalid) {  // counter-clockwise
      if (d == c) return;
      set(d);
    }
    d = c;
    while ((d = mate(d)) != kInvalid) {  // clockwise
      d = next_corner(d);
      set(d);
    }
  }

  // Places the crossings of the half-edge of `c` from the frame at one end; queues its other side.
  F develop_edge(CornerId c, const F& from, bool backwards) {
    const HalfedgeId g = halfedge(c);
    const HalfedgeId along = backwards ? FlipMesh::opposite(g) : g;
    const bool cut = mate(c) == kInvalid;
    F to = from;
    if (start(along).shared()) {
      HalfedgeId h = start(along).halfedge;
      to_opposite(to, h);
    } else {
      const std::size_t side = crossings_of(g).forward ? 0 : 1;
      to = follow(from, along, [&](std::size_t id, const Place& p) {
        development_.points[id].places[side] = p;
        if (!cut) development_.points[id].places[1 - side] = p;
      });
    }
    const F &source = backwards ? to : from, &target = backwards ? from : to;
    const long double square = std::norm(place(source) - place(target));
    largest_ = std::max(largest_, square);
    // No place may be no number.
    if (!cut && !known(c))
      fronts_.emplace(std::pair(square > 0 ? -square : 0, mate(c)), EdgeFrames{target, source});
    return to;
  }

  void measure_angles() {
    development_.corner_angle.assign(halfedges_.size(), 0.0);
    std::vector<FaceId> faces;  // with crossings
    for (CornerId c = 0; c < corner_count(); ++c)
      if (!trace_.of_curve(at(overlaid_.edges.of_corner[at(c)])).empty()) faces.push_back(c / 3);
    sort_unique(faces);
    parallel_for(context_, faces.size(), 512, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t i = begin; i < end; ++i) {
        for (CornerId c = 3 * faces[i]; c < 3 * faces[i] + 3; ++c)
          development_.corner_angle[at(c)] =
              angle_between(halfedge(c), opposite(previous_corner(c)));
      }
    });
  }

  const MetricOverlay& overlaid_;
  const OverlayTrace& trace_;
  const FlipMesh& mesh_;
  const std::vector<HalfedgeId>& halfedges_;  // of M0, per corner
  const ExecutionContext& context_;
  std::vector<Real> lengths_;
  std::vector<Angle<Real>> angles_;
  std::vector<Index> curve_;    // edge of M0 -> the curve that traces it
  std::vector<CornerId> mate_;  // per corner
  Development development_;
  std::vector<char> placed_;  // corners whose place is known
  // By the edge's square, the longest first, and the corner of the face that is entered over it.
  std::map<std::pair<long double, CornerId>, EdgeFrames> fronts_;
  // Squares.
  long double largest_ = 0;  // developed edge
  long double gap_ = 0;      // between two developments of one place
  Index done_ = 0;
};

// Doubles are developed in double where lengths differ little, else in 80 bits, since the shortest
// edges must not drown in the rounding of places far away.
Development develop_own(const MetricOverlay& overlaid, const mesh::EdgeFlags& cuts,
                        const ExecutionContext& context) {
  return std::visit(
      [&]<typename Real>(const std::vector<Real>& all) {
        if constexpr (std::is_same_v<Real, double>) {
          const auto [low, high] = std::minmax_element(all.begin(), all.end());
          const bool mild =
              *high < kMildRatio * *low && *high<kLargestMild&& * low> 1 / kLargestMild;
          if (!mild) {
            return FaceDeveloper<long double>(
                       overlaid, cuts, std::vector<long double>(all.begin(), all.end()), context)
                .run();
          }
        }
        return FaceDeveloper<Real>(overlaid, cuts, all, context).run();
      },
      overlaid.metric->length);
}

// The developed angle at a corner; in faces without crossings it is that of their three places.
double corner_angle(const Development& development, CornerId c) {
  if (development.corner_angle[at(c)] != 0.0) return development.corner_angle[at(c)];
  const Place& p = development.corner[at(c)];
  const Place a = development.corner[at(next_corner(c))] - p;
  const Place b = development.corner[at(previous_corner(c))] - p;
  const Place turn = std::conj(a) * b;
  return static_cast<double>(std::atan2(turn.imag(), turn.real()));
}

// Appends the points of one input edge: `h` is its half-edge.
void write_chain(const MetricOverlay& overlaid, const Development& fine, HalfedgeId h,
                 std::vector<Development::Point>& out) {
  const SplitSurface& split = *overlaid.split;
  const Index begin = split.piece_begin[at(h)], end = split.piece_begin[at(h) + 1];
  for (Index i = begin; i < end; ++i) {
    const HalfedgeId g = split.piece[at(i)];
    const double from = split.piece_from[at(i)];
    const double to = i + 1 < end ? split.piece_from[at(i + 1)] : 1.0;
    const Index e = overlaid.edges.of_corner[at(g)];
    const Crossings crossings(overlaid, e, overlaid.edges.halfedge[at(e)] == g);
    for (std::int64_t k = 0; k < crossings.count(); ++k) {
      const auto& [along, places] = fine.points[crossings.id(k)];
      const auto [s, t] = crossings.seen(along);
      out.push_back({{s * (1.0 - from) + t * (1.0 - to), s * from + t * to}, places});
      if (!crossings.forward) std::swap(out.back().places[0], out.back().places[1]);
    }
    if (i + 1 == end) break;
    // The vertex at the end of the piece.
    const HalfedgeId o = overlaid.adjacency.opposite[at(g)];
    const Place left = fine.corner[at(next_corner(g))];
    out.push_back({{1.0 - to, to}, {left, o == kInvalid ? left : fine.corner[at(o)]}});
  }
}

// The layout of the input from that of the surface it was split into. `edges`: of the input.
Development composed(const MetricOverlay& overlaid, const Development& fine,
                     const InputEdges& edges) {
  const SplitSurface& split = *overlaid.split;
  const std::size_t corner_count = split.corner_begin.size() - 1;
  Development out;
  out.chart_count = fine.chart_count;
  out.closing_error = fine.closing_error;
  out.chart_of_face.resize(corner_count / 3);
  out.corner.resize(corner_count);
  out.corner_angle.assign(corner_count, 0.0);
  for (std::size_t c = 0; c < corner_count; ++c) {
    for (Index i = split.corner_begin[c]; i < split.corner_begin[c + 1]; ++i) {
      const CornerId own = split.corner[at(i)];
      out.corner[c] = fine.corner[at(own)];
      out.corner_angle[c] += corner_angle(fine, own);
      out.chart_of_face[c / 3] = fine.chart_of_face[at(own / 3)];
    }
  }
  out.begin.push_back(0);
  for (const HalfedgeId h : edges.halfedge) {
    write_chain(overlaid, fine, h, out.points);
    out.begin.push_back(std::ssize(out.points));
  }
  return out;
}

// The cuts on the triangulation that the metric was computed on.
mesh::EdgeFlags on_pieces(const mesh::EdgeFlags& cuts, const SplitSurface& split) {
  mesh::EdgeFlags flags(at(split.faces.size()), false);
  for (std::size_t h = 0; h < cuts.size(); ++h) {
    for (Index i = split.piece_begin[h]; cuts[h] && i < split.piece_begin[h + 1]; ++i)
      flags[at(split.piece[at(i)])] = true;
  }
  return flags;
}

// Turns every chart so that its longest boundary edge is horizontal, sets
// charts side by side, and scales the whole into the unit square.
struct ChartPlacement {
  std::vector<Place> direction;  // per chart: unit complex number by which it is turned
  std::vector<Place> shift;      // per chart, added after turning
  long double scale = 1;
  Place origin;  // subtracted last but one, before scaling
  Place placed(const Place& p, Index chart) const {
    return p * direction[at(chart)] + shift[at(chart)];
  }
  Vector2 apply(const Place& p, Index chart) const {
    const Place q = (placed(p, chart) - origin) * scale;
    return {static_cast<double>(q.real()), static_cast<double>(q.imag())};
  }
};

ChartPlacement place_charts(const Development& development, const mesh::Adjacency& adjacency) {
  const auto corner_count = static_cast<CornerId>(development.corner.size());
  const std::size_t charts = at(development.chart_count);
  using Box = Eigen::AlignedBox<long double, 2>;
  // Of edges that are about as long the first: rounding must not turn the map.
  constexpr long double kAboutAsLong = 1 - 1e-6L;
  std::vector<Place> longest(charts, Place{0, 0});
  std::vector<long double> most(charts, 0);
  const auto over_boundary = [&](const auto& visit) {
    for (CornerId c = 0; c < corner_count; ++c) {
      if (adjacency.opposite[at(c)] == kInvalid)
        visit(at(development.chart_of_face[at(c / 3)]),
              development.corner[at(next_corner(c))] - development.corner[at(c)]);
    }
  };
  over_boundary(
      [&](std::size_t chart, const Place& d) { most[chart] = std::max(most[chart], length(d)); });
  over_boundary([&](std::size_t chart, const Place& d) {
    Place& best = longest[chart];
    if (best == Place{0, 0} && length(d) >= kAboutAsLong * most[chart]) best = d;
  });
  for (Place& d : longest) d = length(d) > 0 ? std::conj(d) / length(d) : Place{1, 0};
  ChartPlacement placement{std::move(longest), std::vector<Place>(charts, Place{0, 0}), 1, {}};
  std::vector<Box> boxes(charts);
  for (CornerId c = 0; c < corner_count; ++c) {
    const Index chart = development.chart_of_face[at(c / 3)];
    const Place p = placement.placed(development.corner[at(c)], chart);
    boxes[at(chart)].extend(Box::VectorType(p.real(), p.imag()));
  }
  // Shelves: charts by height in rows about as wide as the whole is high.
  long double area = 0, widest = 0;
  for (const Box& b : boxes) {
    area += b.volume();
    widest = std::max(widest, b.sizes().x());
  }
  const long double row_width = std::max(widest, std::sqrt(area) * 1.1L);
  std::vector<std::size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return boxes[a].sizes().y() > boxes[b].sizes().y();
  });
  long double x = 0, y = 0, shelf = 0, width = 0;
  const long double gap = boxes.size() > 1 ? row_width * 0.01L : 0;
  for (const std::size_t i : order) {
    const Box& b = boxes[i];
    if (x > 0 && x + b.sizes().x() > row_width * 1.0001L) {
      y += shelf + gap;
      x = shelf = 0;
    }
    placement.shift[i] = {x - b.min().x(), y - b.min().y()};
    x += b.sizes().x();
    width = std::max(width, x);
    x += gap;
    shelf = std::max(shelf, b.sizes().y());
  }
  placement.scale = 1 / std::max(width, y + shelf);
  return placement;
}

EdgePointMap to_edge_points(const Development& development, const ChartPlacement& placement,
                            const InputEdges& edges, const mesh::Adjacency& adjacency) {
  EdgePointMap map;
  map.edge_halfedge = edges.halfedge;
  map.edge_of = edges.of_corner;
  map.begin = development.begin;
  map.corner_angle = development.corner_angle;
  map.corner_uv.resize(std::ssize(development.corner), 2);
  map.points.reserve(development.points.size());
  for (std::size_t c = 0; c < development.corner.size(); ++c)
    map.corner_uv.row(static_cast<Eigen::Index>(c)) =
        placement.apply(development.corner[c], development.chart_of_face[c / 3]);
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId other = adjacency.opposite[at(edges.halfedge[e])];
    const Index left = development.chart_of_face[at(edges.halfedge[e] / 3)];
    const Index right = other == kInvalid ? left : development.chart_of_face[at(other / 3)];
    for (std::int64_t i = map.begin[e]; i < map.begin[e + 1]; ++i) {
      const auto& [along, places] = development.points[at(i)];
      map.points.push_back({along, placement.apply(places[0], left),
                            placement.apply(places[other == kInvalid ? 0 : 1], right)});
    }
  }
  return map;
}

// Where the map is finest among these faces (those that could not be rounded):
// 32-bit numbers are finest around zero.
Place finest_place(const Development& development, const ChartPlacement& placement,
                   const std::vector<FaceId>& faces) {
  Place best;
  long double least = std::numeric_limits<long double>::infinity();
  for (const FaceId f : faces) {
    const Place* const p = &development.corner[at(3 * f)];
    const long double size = std::max(length(p[1] - p[0]), length(p[2] - p[0]));
    if (!(size < least)) continue;
    least = size;
    best = placement.placed(p[0], development.chart_of_face[at(f)]);
  }
  return best;
}

// The refinement with the fewest faces that cannot be stored: first in the unit
// square, then, where that is too coarse, with the origin moved to the finest
// place. If none can be stored in 32 bits, the best one for 64. Cuts become
// edges of the map.
void refine_and_round(const mesh::Surface& surface, const Development& development,
                      const InputEdges& edges, const mesh::EdgeFlags& cuts, Refinement refinement,
                      MetricLayout& best, const ExecutionContext& context) {
  constexpr int kOrigins = 3;
  const mesh::Adjacency& adjacency = surface.adjacency();
  ChartPlacement placement = place_charts(development, adjacency);
  ChartPlacement best_placement = placement;
  EdgePointMap points;
  for (int attempt = 0; attempt < kOrigins; ++attempt) {
    points = to_edge_points(development, placement, edges, adjacency);
    RefinedLayout refined = refine_map(surface, points, refinement, Storage::k64And32, context);
    if (attempt > 0 && refined.invalid.size() >= best.too_small.size()) break;
    best.too_small = refined.invalid;
    best.map = std::move(refined);
    best_placement = placement;
    best.origin_moves = attempt;
    if (best.too_small.empty()) break;
    placement.origin = finest_place(development, placement, best.too_small);
  }
  if (!best.too_small.empty()) {
    points = to_edge_points(development, best_placement, edges, adjacency);
    best.map = refine_map(surface, points, refinement, Storage::k64Only, context);
  }
  best.cut_edges = edges_on(surface.faces, points, cuts, best.map);
}

}  // namespace

MetricOverlay overlay_metric(const FlippedMetric& metric, const SplitSurface* split,
                             const mesh::Surface& surface, const ExecutionContext& context) {
  constexpr std::int64_t kMaxCrossings = 20'000'000;
  mesh::Adjacency own = split == nullptr ? surface.adjacency()
                                         : mesh::build_adjacency(split->vertex_count, split->faces);
  InputEdges edges = number_edges(own);
  std::vector<HalfedgeId> curves;
  curves.reserve(edges.halfedge.size());
  for (const HalfedgeId h : edges.halfedge) curves.push_back(metric.input_halfedge[at(h)]);
  return {&metric, split, std::move(own), std::move(edges),
          build_overlay(metric, curves, kMaxCrossings, context)};
}

MetricLayout lay_out_metric(const mesh::Surface& surface, const MetricOverlay& overlaid,
                            const mesh::EdgeFlags& cuts, Refinement refinement,
                            ExecutionContext& context) {
  MetricLayout out;
  Stopwatch watch;
  context.report("layout", 0.0);
  const InputEdges edges = number_edges(surface.adjacency());
  Development development =
      develop_own(overlaid, overlaid.split ? on_pieces(cuts, *overlaid.split) : cuts, context);
  if (overlaid.split) development = composed(overlaid, development, edges);
  out.chart_count = development.chart_count;
  out.closing_error = development.closing_error;
  out.seconds_layout = watch.seconds();
  watch.restart();
  context.report("refinement", 0.4);
  refine_and_round(surface, development, edges, cuts, refinement, out, context);
  out.seconds_refine = watch.seconds();
  return out;
}

}  // namespace flipfree::intrinsic
