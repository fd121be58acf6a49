#include "flipfree/intrinsic/layout/development.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <queue>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {
namespace {

// The overlay of a triangulation M0 with the final one, T.
struct TracedMesh {
  const OverlayCoordinates& coordinates;
  const OverlayTrace& trace;
  const OverlayPositions& positions;
  const std::vector<HalfedgeId>& halfedge_of_corner;  // 3 #F: of M0, corner k to k + 1
  std::vector<Index> curve_of_edge;  // #E of M0: curve that traces it, kInvalid = none
  std::vector<char> cut;             // #E of M0: is it a cut or boundary?
};

// Longest edge over shortest up to which double is enough: a thousand roundings of the largest
// place are then 1e-7 of the shortest edge. And fourth powers of lengths must be representable.
constexpr double kMildRatio = 1 << 20;
constexpr double kLargestMild = 1e60;

// Squares stay in the range of these numbers, so no scaling is needed.
long double square_of(const Place& p, const Place& q) {
  return (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y);
}

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
class CurveDeveloper {
 public:
  CurveDeveloper(const TracedMesh& input, std::vector<Real> lengths,
                 const ExecutionContext& context)
      : input_(input),
        mesh_(input.coordinates.current()),
        lengths_(std::move(lengths)),
        angles_(mesh_.halfedge_count()) {
    parallel_for(context, angles_.size(), 4096,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   for (std::size_t h = begin; h < end; ++h)
                     angles_[h] = corner_angle(static_cast<HalfedgeId>(h));
                 });
  }

  using F = Frame<Real>;

  const CurveStart& start(HalfedgeId g) const { return input_.trace.start[at(g)]; }
  Place place(const F& f) const { return {numeric::widen(f.x), numeric::widen(f.y)}; }
  long double length(HalfedgeId h) const { return numeric::widen(lengths_[at(h >> 1)]); }

  // From the frame of start(g) to that of the next half-edge of M0 counter-clockwise, `to`.
  F rotate_ccw(F frame, HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
    if (a.halfedge == b.halfedge && b.place > a.place) return frame;
    HalfedgeId h = a.halfedge;
    for (std::size_t guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
      turn(frame, angles_[at(h)].cosine, angles_[at(h)].sine);
      h = mesh_.rotate_ccw(h);
      if (h == b.halfedge) return frame;
    }
    throw InternalError("layout: input half-edge " + std::to_string(to) +
                        " was not found around its source");
  }
  F rotate_cw(F frame, HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
    if (a.halfedge == b.halfedge && b.place < a.place) return frame;
    HalfedgeId h = a.halfedge;
    for (std::size_t guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
      h = mesh_.next_of(FlipMesh::opposite(h));
      turn(frame, angles_[at(h)].cosine, -angles_[at(h)].sine);
      if (h == b.halfedge) return frame;
    }
    throw InternalError("layout: input half-edge " + std::to_string(to) +
                        " was not found around its source");
  }

  // Angle from the first piece of half-edge `from` of M0 counter-clockwise to that of `to`, the
  // next one around.
  double angle_between(HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
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

  // Follows half-edge g of M0, an edge of T as well, from the frame of start(g) to that of
  // start(opposite(g)).
  F along_shared(F frame, HalfedgeId g) const {
    to_opposite(frame, start(g).halfedge);
    return frame;
  }
  // The same for any other half-edge. Calls visit(crossing id, place) in order along g.
  template <typename Visit>
  F follow(F frame, HalfedgeId g, const Visit& visit) const {
    const CurveStart& s = start(g);
    HalfedgeId h = s.halfedge;
    const auto curve = static_cast<std::size_t>(input_.curve_of_edge[at(g >> 1)]);
    const OverlayTrace& trace = input_.trace;
    const bool forward = trace.curves[curve] == g;
    const std::int64_t begin = trace.begin[curve], end = trace.begin[curve + 1];
    for (std::int64_t i = 0; i < end - begin; ++i) {
      const auto id = static_cast<std::size_t>(forward ? begin + i : end - 1 - i);
      // Against the curve's own direction it is the opposite half-edge through which a face is
      // left.
      const HalfedgeId recorded = trace.crossings[id].through;
      const HalfedgeId through = forward ? recorded : FlipMesh::opposite(recorded);
      for (int k = 0; h != through; ++k) {
        if (k == 3)
          throw InternalError("layout: input half-edge " + std::to_string(g) +
                              " jumps between faces");
        to_next(frame, h);
        h = mesh_.next_of(h);
      }
      const Between& between = input_.positions.on_edge[id];
      const Real t(forward ? between.target : between.source);
      const Real& l = lengths_[at(h >> 1)];
      visit(id, Place{numeric::widen(frame.x + frame.dx * l * t),
                      numeric::widen(frame.y + frame.dy * l * t)});
      to_opposite(frame, h);
      h = FlipMesh::opposite(h);
    }
    to_next(frame, h);
    h = mesh_.next_of(h);
    to_next(frame, h);
    h = mesh_.next_of(h);
    if (h != start(FlipMesh::opposite(g)).halfedge) {
      throw InternalError("layout: input half-edge " + std::to_string(g) +
                          " ends in the wrong corner");
    }
    return frame;
  }

 private:
  // Angle from the half-edge of T at which half-edge g of M0 starts to g's first piece.
  double offset(HalfedgeId g) const {
    const CurveStart& s = start(g);
    if (s.shared()) return 0.0;
    const auto curve = static_cast<std::size_t>(input_.curve_of_edge[at(g >> 1)]);
    const OverlayTrace& trace = input_.trace;
    const bool forward = trace.curves[curve] == g;
    const auto id =
        static_cast<std::size_t>(forward ? trace.begin[curve] : trace.begin[curve + 1] - 1);
    const Between& between = input_.positions.on_edge[id];
    // The opposite side runs from the target of h; seen against the curve its ends are swapped.
    const long double near = forward ? between.source : between.target;
    const long double far = forward ? between.target : between.source;
    const Angle<Real>& angle = angles_[at(s.halfedge)];
    const long double a = length(s.halfedge) * near, b = length(mesh_.previous(s.halfedge)) * far;
    return static_cast<double>(
        std::atan2(b * numeric::widen(angle.sine), a + b * numeric::widen(angle.cosine)));
  }
  static void turn(F& f, const Real& c, const Real& s) {
    const Real x = f.dx * c - f.dy * s;
    f.dy = f.dx * s + f.dy * c;
    f.dx = x;
  }
  void to_next(F& f, HalfedgeId h) const {
    const Real& l = lengths_[at(h >> 1)];
    f.x = f.x + f.dx * l;
    f.y = f.y + f.dy * l;
    const Angle<Real>& a = angles_[at(mesh_.next_of(h))];
    turn(f, -a.cosine, a.sine);  // by pi - angle
  }
  void to_opposite(F& f, HalfedgeId h) const {
    const Real& l = lengths_[at(h >> 1)];
    f.x = f.x + f.dx * l;
    f.y = f.y + f.dy * l;
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

  const TracedMesh& input_;
  const FlipMesh& mesh_;
  std::vector<Real> lengths_;
  std::vector<Angle<Real>> angles_;
};

// An uncut input edge over which the next face may be developed: frames of start(g) and
// start(opposite(g)), g the half-edge of the corner in the face to be entered.
template <typename Real>
struct EdgeFrames {
  Frame<Real> at_source, at_target;
};

// An edge that a face can be developed over: its square, the face's corner, and where the frames
// lie. The longest comes first.
struct Front {
  long double square = 0;
  CornerId corner = kInvalid;
  std::size_t frames = 0;
  bool operator<(const Front& other) const {
    return square != other.square ? square < other.square : corner > other.corner;
  }
};

template <typename Real>
class FaceDeveloper {
 public:
  FaceDeveloper(const TracedMesh& input, std::vector<Real> lengths, const ExecutionContext& context)
      : input_(input),
        halfedges_(input.halfedge_of_corner),
        developer_(input, std::move(lengths), context),
        mate_(halfedges_.size(), kInvalid),
        placed_(halfedges_.size(), 0),
        left_(faces_by_size()) {
    corner_of_.assign(input.coordinates.input().halfedge_count(), kInvalid);
    for (CornerId c = 0; c < corner_count(); ++c) corner_of_[at(halfedge(c))] = c;
    for (CornerId c = 0; c < corner_count(); ++c) {
      if (input.cut[at(halfedge(c) >> 1)] == 0) mate_[at(c)] = corner_of_[at(opposite(c))];
    }
    development_.corner.resize(halfedges_.size());
    development_.crossing.resize(input.trace.crossings.size());
    development_.chart_of_face.assign(halfedges_.size() / 3, kInvalid);
  }

  Development run(const ExecutionContext& context) {
    for (FaceId root = largest_left(); root != kInvalid; root = largest_left()) {
      const Index chart = development_.chart_count++;
      place_root(root, chart);
      while (!queue_.empty()) place_next(chart, context);
    }
    measure_angles(context);
    development_.closing_error =
        largest_ > 0 ? static_cast<double>(std::sqrt(gap_ / largest_)) : 0.0;
    return std::move(development_);
  }

 private:
  using F = Frame<Real>;

  Index corner_count() const { return static_cast<Index>(halfedges_.size()); }
  HalfedgeId halfedge(CornerId c) const { return halfedges_[at(c)]; }
  HalfedgeId opposite(CornerId c) const { return FlipMesh::opposite(halfedge(c)); }
  // The corner whose half-edge is opposite to that of c; kInvalid at cuts.
  CornerId mate(CornerId c) const { return mate_[at(c)]; }
  bool is_cut(CornerId c) const { return mate(c) == kInvalid; }
  bool is_done(FaceId f) const { return development_.chart_of_face[at(f)] != kInvalid; }
  // Is the edge of this corner placed already, from its other side?
  bool known(CornerId c) const { return !is_cut(c) && is_done(mate(c) / 3); }

  // The faces by their longest final edge, rising.
  std::vector<FaceId> faces_by_size() const {
    std::vector<long double> size(halfedges_.size() / 3, 0);
    for (CornerId c = 0; c < corner_count(); ++c) {
      const HalfedgeId h = developer_.start(halfedge(c)).halfedge;
      size[at(c / 3)] = std::max(size[at(c / 3)], developer_.length(h));
    }
    std::vector<FaceId> faces(size.size());
    std::iota(faces.rbegin(), faces.rend(), 0);
    std::stable_sort(faces.begin(), faces.end(),
                     [&](FaceId a, FaceId b) { return size[at(a)] < size[at(b)]; });
    return faces;
  }

  // The face with the longest final edge goes first, in every chart.
  FaceId largest_left() {
    while (!left_.empty() && is_done(left_.back())) left_.pop_back();
    return left_.empty() ? kInvalid : left_.back();
  }

  // The first edge of the root face lies along the x axis at its start.
  void place_root(FaceId root, Index chart) {
    const CornerId c = 3 * root, n = next_corner(c), p = previous_corner(c);
    development_.chart_of_face[at(root)] = chart;
    const F x = F{};
    const F y = develop_edge(c, x, false);
    settle(c, developer_.place(x));
    settle(n, developer_.place(y));
    const F z = develop_edge(n, developer_.rotate_cw(y, opposite(c), halfedge(n)), false);
    settle(p, developer_.place(z));
    develop_edge(p, developer_.rotate_ccw(x, halfedge(c), opposite(p)), true);
  }

  void place_next(Index chart, const ExecutionContext& context) {
    constexpr Index kFacesPerCheck = 1024;
    const Front top = queue_.top();
    queue_.pop();
    const EdgeFrames<Real> front = frames_[top.frames];
    unused_.push_back(top.frames);
    const CornerId c = top.corner, n = next_corner(c), p = previous_corner(c);
    if (is_done(c / 3)) return;
    development_.chart_of_face[at(c / 3)] = chart;
    if (++done_ % kFacesPerCheck == 0) context.check();
    settle(c, developer_.place(front.at_source));
    settle(n, developer_.place(front.at_target));
    const F left = developer_.rotate_ccw(front.at_source, halfedge(c), opposite(p));
    const F right = developer_.rotate_cw(front.at_target, opposite(c), halfedge(n));
    if (!known(n)) settle(p, developer_.place(develop_edge(n, right, false)));
    if (!known(p)) settle(p, developer_.place(develop_edge(p, left, true)));
  }

  // Gives every corner of the uncut fan around `c` this place, unless one has it already.
  void settle(CornerId c, const Place& p) {
    if (placed_[at(c)] != 0) {
      gap_ = std::max(gap_, square_of(development_.corner[at(c)], p));
      return;
    }
    const auto set = [&](CornerId d) {
      development_.corner[at(d)].x = p.x;
      development_.corner[at(d)].y = p.y;
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

  // Places the crossings of the half-edge of `c` from the frame at one end; pushes its other side.
  F develop_edge(CornerId c, const F& from, bool backwards) {
    const HalfedgeId g = halfedge(c);
    const HalfedgeId along = backwards ? FlipMesh::opposite(g) : g;
    const bool cut = is_cut(c);
    F to;
    if (developer_.start(along).shared()) {
      to = developer_.along_shared(from, along);
    } else {
      const auto curve = static_cast<std::size_t>(input_.curve_of_edge[at(g >> 1)]);
      const std::size_t side = input_.trace.curves[curve] == g ? 0 : 1;
      to = developer_.follow(from, along, [&](std::size_t id, const Place& p) {
        development_.crossing[id][side] = p;
        if (!cut) development_.crossing[id][1 - side] = p;
      });
    }
    const F& source = backwards ? to : from;
    const F& target = backwards ? from : to;
    const long double size = square_of(developer_.place(source), developer_.place(target));
    largest_ = std::max(largest_, size);
    if (!cut && !is_done(mate(c) / 3)) push(size, mate(c), {target, source});
    return to;
  }

  void push(long double square, CornerId corner, EdgeFrames<Real> edge) {
    std::size_t slot = frames_.size();
    if (unused_.empty()) {
      frames_.push_back(std::move(edge));
    } else {
      slot = unused_.back();
      unused_.pop_back();
      frames_[slot] = std::move(edge);
    }
    queue_.push({square > 0 ? square : 0, corner, slot});  // no place may be no number
  }

  void measure_angles(const ExecutionContext& context) {
    development_.corner_angle.assign(halfedges_.size(), 0.0);
    std::vector<FaceId> faces;  // with crossings
    const OverlayTrace& trace = input_.trace;
    for (std::size_t curve = 0; curve < trace.curves.size(); ++curve) {
      if (trace.begin[curve + 1] == trace.begin[curve]) continue;
      const HalfedgeId g = trace.curves[curve];
      for (const CornerId c : {corner_of_[at(g)], corner_of_[at(FlipMesh::opposite(g))]})
        if (c != kInvalid) faces.push_back(c / 3);
    }
    sort_unique(faces);
    parallel_for(context, faces.size(), 512, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t i = begin; i < end; ++i) {
        for (CornerId c = 3 * faces[i]; c < 3 * faces[i] + 3; ++c) {
          development_.corner_angle[at(c)] =
              developer_.angle_between(halfedge(c), opposite(previous_corner(c)));
        }
      }
    });
  }

  const TracedMesh& input_;
  const std::vector<HalfedgeId>& halfedges_;  // of M0, per corner
  const CurveDeveloper<Real> developer_;
  std::vector<CornerId> corner_of_;  // half-edge of M0 -> corner
  std::vector<CornerId> mate_;       // per corner
  Development development_;
  std::vector<char> placed_;  // corners whose place is known
  std::vector<FaceId> left_;  // faces by rising size
  std::priority_queue<Front> queue_;
  std::vector<EdgeFrames<Real>> frames_;
  std::vector<std::size_t> unused_;  // places in `frames_`
  // Squares.
  long double largest_ = 0;  // developed edge
  long double gap_ = 0;      // between two developments of one place
  Index done_ = 0;
};

// Doubles are developed in double where lengths differ little, else in 80 bits, since the shortest
// edges must not drown in the rounding of places far away.
Development develop_traced(const TracedMesh& input, const Scalars& lengths,
                           const ExecutionContext& context) {
  return std::visit(
      [&]<typename Real>(const std::vector<Real>& all) {
        if constexpr (std::is_same_v<Real, double>) {
          const auto [low, high] = std::minmax_element(all.begin(), all.end());
          const bool mild =
              *high < kMildRatio * *low && *high<kLargestMild&& * low> 1 / kLargestMild;
          if (!mild) {
            return FaceDeveloper<long double>(
                       input, std::vector<long double>(all.begin(), all.end()), context)
                .run(context);
          }
        }
        return FaceDeveloper<Real>(input, all, context).run(context);
      },
      lengths);
}

// The developed angle at a corner; in faces without crossings it is that of their three places.
double corner_angle(const Development& development, CornerId c) {
  if (development.corner_angle[at(c)] != 0.0) return development.corner_angle[at(c)];
  const Place &p = development.corner[at(c)], &a = development.corner[at(next_corner(c))],
              &b = development.corner[at(previous_corner(c))];
  const long double ax = a.x - p.x, ay = a.y - p.y, bx = b.x - p.x, by = b.y - p.y;
  return static_cast<double>(std::atan2(ax * by - ay * bx, ax * bx + ay * by));
}

// Appends the points of one input edge: `h` is its half-edge.
class ChainWriter {
 public:
  ChainWriter(const MetricOverlay& fine, const Development& development, InputDevelopment& out)
      : fine_(fine), split_(*fine.split), development_(development), out_(out) {}

  void write(HalfedgeId h) {
    const Index begin = split_.piece_begin[at(h)], end = split_.piece_begin[at(h) + 1];
    for (Index i = begin; i < end; ++i) {
      const double from = split_.piece_from[at(i)];
      const double to = i + 1 < end ? split_.piece_from[at(i + 1)] : 1.0;
      write_crossings(split_.piece[at(i)], from, to);
      if (i + 1 < end) write_vertex(split_.piece[at(i)], to);
    }
  }

 private:
  void write_crossings(HalfedgeId g, double from, double to) {
    const Index e = fine_.edges.of_corner[at(g)];
    const bool forward = fine_.edges.halfedge[at(e)] == g;
    const std::int64_t begin = fine_.overlay.trace.begin[at(e)],
                       end = fine_.overlay.trace.begin[at(e) + 1];
    for (std::int64_t i = 0; i < end - begin; ++i) {
      const auto id = static_cast<std::size_t>(forward ? begin + i : end - 1 - i);
      const Between& own = fine_.overlay.positions.on_curve[id];
      const double s = forward ? own.source : own.target, t = forward ? own.target : own.source;
      out_.along.push_back({s * (1.0 - from) + t * (1.0 - to), s * from + t * to});
      const std::array<Place, 2>& sides = development_.crossing[id];
      out_.development.crossing.push_back({sides[forward ? 0 : 1], sides[forward ? 1 : 0]});
    }
  }
  // The vertex at the end of piece g.
  void write_vertex(HalfedgeId g, double share) {
    const HalfedgeId o = fine_.adjacency.opposite[at(g)];
    const Place left = development_.corner[at(next_corner(g))];
    const Place right = o == kInvalid ? left : development_.corner[at(o)];
    out_.along.push_back({1.0 - share, share});
    out_.development.crossing.push_back({left, right});
  }

  const MetricOverlay& fine_;
  const SplitSurface& split_;
  const Development& development_;
  InputDevelopment& out_;
};

}  // namespace

InputEdges number_edges(const mesh::Adjacency& adjacency) {
  InputEdges edges;
  edges.of_corner.assign(adjacency.opposite.size(), kInvalid);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && o < h) {
      edges.of_corner[at(h)] = edges.of_corner[at(o)];
    } else {
      edges.of_corner[at(h)] = static_cast<Index>(edges.halfedge.size());
      edges.halfedge.push_back(h);
    }
  }
  return edges;
}

namespace {

// The layout of the input from that of the surface it was split into.
InputDevelopment composed(const MetricOverlay& overlaid, const Development& fine,
                          const InputEdges& edges) {
  const SplitSurface& split = *overlaid.split;
  const auto corner_count = static_cast<CornerId>(split.corner_begin.size()) - 1;
  InputDevelopment out;
  Development& development = out.development;
  development.chart_count = fine.chart_count;
  development.closing_error = fine.closing_error;
  development.chart_of_face.resize(at(corner_count / 3));
  development.corner.resize(at(corner_count));
  development.corner_angle.assign(at(corner_count), 0.0);
  for (CornerId c = 0; c < corner_count; ++c) {
    for (Index i = split.corner_begin[at(c)]; i < split.corner_begin[at(c) + 1]; ++i) {
      const CornerId own = split.corner[at(i)];
      development.corner[at(c)] = fine.corner[at(own)];
      development.corner_angle[at(c)] += corner_angle(fine, own);
      development.chart_of_face[at(c / 3)] = fine.chart_of_face[at(own / 3)];
    }
  }
  ChainWriter writer(overlaid, fine, out);
  out.begin.push_back(0);
  for (const HalfedgeId h : edges.halfedge) {
    writer.write(h);
    out.begin.push_back(static_cast<std::int64_t>(out.along.size()));
  }
  return out;
}

// The cuts on the triangulation that the metric was computed on.
mesh::EdgeFlags on_pieces(const mesh::EdgeFlags& cuts, const SplitSurface& split) {
  mesh::EdgeFlags flags(static_cast<std::size_t>(3 * split.faces.rows()), false);
  for (std::size_t h = 0; h < cuts.size(); ++h) {
    for (Index i = split.piece_begin[h]; cuts[h] && i < split.piece_begin[h + 1]; ++i)
      flags[at(split.piece[at(i)])] = true;
  }
  return flags;
}

}  // namespace

InputDevelopment develop(const MetricOverlay& overlaid, const InputEdges& edges,
                         const mesh::EdgeFlags& cuts, const ExecutionContext& context) {
  const FlippedMetric& metric = *overlaid.metric;
  const Overlay& overlay = overlaid.overlay;
  const bool split = overlaid.split != nullptr;
  const mesh::EdgeFlags own_cuts = split ? on_pieces(cuts, *overlaid.split) : cuts;
  TracedMesh input{overlay.coordinates,
                   overlay.trace,
                   overlay.positions,
                   metric.input_halfedge,
                   std::vector<Index>(metric.initial.edge_count(), kInvalid),
                   std::vector<char>(metric.initial.edge_count(), 0)};
  for (std::size_t e = 0; e < overlaid.edges.halfedge.size(); ++e) {
    const HalfedgeId h = overlaid.edges.halfedge[e];
    const EdgeId own = FlipMesh::edge(metric.input_halfedge[at(h)]);
    input.curve_of_edge[at(own)] = static_cast<Index>(e);
    input.cut[at(own)] = overlaid.adjacency.opposite[at(h)] == kInvalid || own_cuts[at(h)];
  }
  Development own = develop_traced(input, metric.length, context);
  if (split) return composed(overlaid, own, edges);
  return {std::move(own), overlay.trace.begin, overlay.positions.on_curve};
}

}  // namespace flipfree::intrinsic
