#include "flipfree/intrinsic/layout/development.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/intrinsic/layout/curve_developer.h"
#include "flipfree/numeric/big_float.h"

namespace flipfree::intrinsic {
namespace {

// Longest edge over shortest up to which double is enough: a thousand roundings of the largest
// place are then 1e-7 of the shortest edge. And fourth powers of lengths must be representable.
constexpr double kMildRatio = 1 << 20;
constexpr double kLargestMild = 1e60;

// Squares stay in the range of these numbers, so no scaling is needed.
long double square_of(const Place& p, const Place& q) {
  return (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y);
}

// An uncut input edge over which the next face may be developed: frames of start(g) and
// start(opposite(g)), g the half-edge of the corner in the face to be entered.
template <typename Real>
struct EdgeFrames {
  Frame<Real> at_source, at_target;
};

// An edge that a face can be developed over: the face's corner, and where the frames lie.
struct Front {
  CornerId corner;
  std::size_t frames;
};

// Fronts by falling size of their edge, to within a factor of sqrt(2), first come first served: a
// bucket per octave of the squared length, below the largest edge of all.
class FrontQueue {
 public:
  explicit FrontQueue(long double largest_square)
      : buckets_(kOctaves), highest_(largest_square > 0 ? std::ilogb(largest_square) : 0) {}

  bool empty() const { return first_ == kOctaves; }
  void push(long double square, const Front& front) {
    const int octave =
        square > 0 ? std::clamp(highest_ - std::ilogb(square), 0, kOctaves - 1) : kOctaves - 1;
    buckets_[at(octave)].fronts.push_back(front);
    first_ = std::min(first_, octave);
  }
  // Precondition: not empty.
  Front pop() {
    Bucket& bucket = buckets_[at(first_)];
    const Front front = bucket.fronts[bucket.head++];
    if (bucket.head == bucket.fronts.size()) {
      bucket.fronts.clear();
      bucket.head = 0;
      while (first_ < kOctaves && buckets_[at(first_)].fronts.empty()) ++first_;
    }
    return front;
  }

 private:
  static constexpr int kOctaves = 2048;  // what is smaller by a factor of 2^1024 comes last
  struct Bucket {
    std::vector<Front> fronts;
    std::size_t head = 0;  // those before are done
  };
  std::vector<Bucket> buckets_;
  int highest_;
  int first_ = kOctaves;  // not empty, if any is
};

// Develops input face after input face, always over the longest edge that is known.
template <typename Real>
class FaceDeveloper {
 public:
  FaceDeveloper(const TracedMesh& input, std::vector<Real> lengths, const ExecutionContext& context)
      : input_(input),
        halfedges_(*input.halfedge_of_corner),
        developer_(input, std::move(lengths), context),
        mate_(halfedges_.size(), kInvalid),
        placed_(halfedges_.size(), 0),
        size_(sizes()),
        queue_(square(*std::max_element(size_.begin(), size_.end()))) {
    corner_of_.assign(input.coordinates->input().halfedge_count(), kInvalid);
    for (CornerId c = 0; c < corner_count(); ++c) corner_of_[at(halfedge(c))] = c;
    for (CornerId c = 0; c < corner_count(); ++c) {
      if ((*input.cut)[at(halfedge(c) >> 1)] == 0) mate_[at(c)] = corner_of_[at(opposite(c))];
    }
    development_.corner.resize(halfedges_.size());
    development_.crossing.resize(input.trace->crossings.size());
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

  static long double square(long double x) { return x * x; }
  Index corner_count() const { return static_cast<Index>(halfedges_.size()); }
  HalfedgeId halfedge(CornerId c) const { return halfedges_[at(c)]; }
  HalfedgeId opposite(CornerId c) const { return FlipMesh::opposite(halfedge(c)); }
  // The corner whose half-edge is opposite to that of c; kInvalid at cuts.
  CornerId mate(CornerId c) const { return mate_[at(c)]; }
  bool is_cut(CornerId c) const { return mate(c) == kInvalid; }
  bool is_done(FaceId f) const { return development_.chart_of_face[at(f)] != kInvalid; }
  // Is the edge of this corner placed already, from its other side?
  bool known(CornerId c) const { return !is_cut(c) && is_done(mate(c) / 3); }

  // Longest final edge at the corners of every face.
  std::vector<long double> sizes() const {
    std::vector<long double> size(halfedges_.size() / 3, 0);
    for (CornerId c = 0; c < corner_count(); ++c) {
      const HalfedgeId h = developer_.start(halfedge(c)).halfedge;
      size[at(c / 3)] = std::max(size[at(c / 3)], developer_.length(h));
    }
    return size;
  }

  // The face with the longest final edge goes first, in every chart. The faces are only sorted
  // where there is more than one chart.
  FaceId largest_left() {
    if (development_.chart_count == 0) {
      const auto largest = std::max_element(size_.begin(), size_.end());
      return static_cast<FaceId>(largest - size_.begin());
    }
    if (development_.chart_count == 1) {
      for (FaceId f = 0; f < corner_count() / 3; ++f)
        if (!is_done(f)) left_.push_back(f);
      std::stable_sort(left_.begin(), left_.end(),
                       [&](FaceId a, FaceId b) { return size_[at(a)] < size_[at(b)]; });
    }
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
    const Front top = queue_.pop();
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
      const auto curve = static_cast<std::size_t>((*input_.curve_of_edge)[at(g >> 1)]);
      const std::size_t side = input_.trace->curves[curve] == g ? 0 : 1;
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
    queue_.push(square, {corner, slot});
  }

  void measure_angles(const ExecutionContext& context) {
    development_.corner_angle.assign(halfedges_.size(), 0.0);
    std::vector<FaceId> faces;  // with crossings
    const OverlayTrace& trace = *input_.trace;
    for (std::size_t curve = 0; curve < trace.curves.size(); ++curve) {
      if (trace.begin[curve + 1] == trace.begin[curve]) continue;
      const HalfedgeId g = trace.curves[curve];
      for (const CornerId c : {corner_of_[at(g)], corner_of_[at(FlipMesh::opposite(g))]})
        if (c != kInvalid) faces.push_back(c / 3);
    }
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
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
  std::vector<char> placed_;       // corners whose place is known
  std::vector<long double> size_;  // per face
  std::vector<FaceId> left_;       // faces by rising size, for charts after the first
  FrontQueue queue_;
  std::vector<EdgeFrames<Real>> frames_;
  std::vector<std::size_t> unused_;  // places in `frames_`
  // Squares.
  long double largest_ = 0;  // developed edge
  long double gap_ = 0;      // between two developments of one place
  Index done_ = 0;
};

template <typename Real>
Development run_developer(const TracedMesh& input, std::vector<Real> lengths,
                          const ExecutionContext& context) {
  return FaceDeveloper<Real>(input, std::move(lengths), context).run(context);
}

}  // namespace

// Doubles are developed in double where lengths differ little, else in 80 bits, since the shortest
// edges must not drown in the rounding of places far away.
template <>
Development develop<double>(const TracedMesh& input, const std::vector<double>& lengths,
                            const ExecutionContext& context) {
  const auto [least, most] = std::minmax_element(lengths.begin(), lengths.end());
  const double low = *least, high = *most;
  const bool mild = high < kMildRatio * low && high < kLargestMild && low > 1 / kLargestMild;
  if (mild) return run_developer(input, lengths, context);
  return run_developer(input, std::vector<long double>(lengths.begin(), lengths.end()), context);
}
template <typename Real>
Development develop(const TracedMesh& input, const std::vector<Real>& lengths,
                    const ExecutionContext& context) {
  return run_developer(input, lengths, context);
}
template Development develop<numeric::BigFloat<4>>(const TracedMesh&,
                                                   const std::vector<numeric::BigFloat<4>>&,
                                                   const ExecutionContext&);
template Development develop<numeric::BigFloat<16>>(const TracedMesh&,
                                                    const std::vector<numeric::BigFloat<16>>&,
                                                    const ExecutionContext&);
template Development develop<numeric::BigFloat<64>>(const TracedMesh&,
                                                    const std::vector<numeric::BigFloat<64>>&,
                                                    const ExecutionContext&);

}  // namespace flipfree::intrinsic
