#include "flipfree/seamless/padding/topology/paths/separating_path.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <queue>
#include <utility>

namespace flipfree::seamless {
namespace {

constexpr int kStepsPerCheck = 1024;
constexpr std::size_t kMostPathsPerVertex = 24;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// A path from a place to a vertex.
struct Way {
  VertexId vertex;
  Index excess;  // passed so far, and the start's own share
  double distance;
  Index before;        // the way that it continues, or kInvalid
  HalfedgeId arrival;  // its last half-edge
  Index from;          // place where it began
};

class CoverSearch {
 public:
  CoverSearch(const Canvas& canvas, const DiskBoundary& boundary,
              const std::function<bool(const PathEnds&)>& allowed)
      : canvas_(canvas),
        boundary_(boundary),
        allowed_(allowed),
        crossed_(excess_crossed(canvas, boundary)),
        ways_of_(at(canvas.vertex_count())) {
    along_.push_back(0);
    for (const HalfedgeId h : boundary.halfedges) along_.push_back(along_.back() + crossed_[at(h)]);
  }

  void start(Index place) {
    canvas_.for_each_inside(boundary_.halfedges[at(place)], [&](HalfedgeId h) {
      cross(h, {kInvalid, share(place), 0.0, kInvalid, kInvalid, place}, kInvalid);
    });
  }

  std::optional<SeparatingPath> run(const ExecutionContext& context) {
    const std::size_t most = kMostPathsPerVertex * at(canvas_.vertex_count());
    for (int step = 1; !queue_.empty() && queue_.top().first < best_distance_; ++step) {
      if (step % kStepsPerCheck == 0) context.check();
      if (ways_.size() > most) break;
      const Index way = queue_.top().second;
      queue_.pop();
      const Way here = ways_[at(way)];
      const std::vector<Index>& known = ways_of_[at(here.vertex)];
      if (std::find(known.begin(), known.end(), way) == known.end())
        continue;  // a shorter one came
      canvas_.mesh().for_each_outgoing(here.vertex, [&](HalfedgeId h) { cross(h, here, way); });
    }
    return found();
  }

 private:
  using Entry = std::pair<double, Index>;

  // What makes ways comparable that began in different places: which way they would go on in a
  // flat metric with right angles at corners.
  Index share(Index place) const { return along_[at(place)] - boundary_.corners_below[at(place)]; }

  void cross(HalfedgeId h, const Way& here, Index way) {
    Way next = here;
    next.vertex = canvas_.mesh().target(h);
    next.excess += crossed_[at(h)];
    next.distance += canvas_.length(h);
    next.before = way;
    next.arrival = h;
    if (canvas_.is_free(next.vertex)) {
      go_on(next);
    } else if (canvas_.on_curve(next.vertex) && next.distance < best_distance_) {
      arrive(next);
    }
  }

  void go_on(const Way& way) {
    std::vector<Index>& known = ways_of_[at(way.vertex)];
    if (!known.empty() && passes(way.before, way.vertex)) return;
    const auto index = static_cast<Index>(ways_.size());
    const auto same = std::find_if(known.begin(), known.end(), [&](Index other) {
      return ways_[at(other)].excess == way.excess;
    });
    if (same != known.end()) {
      if (ways_[at(*same)].distance <= way.distance) return;
      *same = index;
    } else {
      known.push_back(index);
    }
    ways_.push_back(way);
    queue_.push({way.distance, index});
  }

  bool passes(Index way, VertexId v) const {
    for (; way != kInvalid; way = ways_[at(way)].before) {
      if (ways_[at(way)].vertex == v) return true;
    }
    return false;
  }

  void arrive(const Way& way) {
    const HalfedgeId sector = canvas_.sector_of(canvas_.mesh().opposite(way.arrival));
    const PathEnds ends{way.from, boundary_.place[at(sector)]};
    if (ends.from == ends.to || !allowed_(ends)) return;
    const Index corners = left_corners(boundary_, ends);
    if (corners % 4 == 0) return;
    // Closed along the boundary, counter-clockwise.
    Index enclosed = way.excess - share(ends.from) + along_[at(ends.from)] - along_[at(ends.to)];
    if (ends.from < ends.to) enclosed += along_.back();
    if (corners != 4 + enclosed) return;
    best_distance_ = way.distance;
    best_ = way;
    best_ends_ = ends;
  }

  std::optional<SeparatingPath> found() const {
    if (best_ends_.from == kInvalid) return std::nullopt;
    SeparatingPath path{best_ends_, left_corners(boundary_, best_ends_), {best_.arrival}};
    for (Index way = best_.before; way != kInvalid; way = ways_[at(way)].before)
      path.halfedges.push_back(ways_[at(way)].arrival);
    std::reverse(path.halfedges.begin(), path.halfedges.end());
    return path;
  }

  const Canvas& canvas_;
  const DiskBoundary& boundary_;
  const std::function<bool(const PathEnds&)>& allowed_;
  std::vector<Index> crossed_;
  std::vector<Index> along_;  // per place, and in all: excess crossed by the boundary before it
  std::vector<Way> ways_;
  std::vector<std::vector<Index>> ways_of_;  // per vertex: the best of each sheet
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  double best_distance_ = std::numeric_limits<double>::infinity();
  Way best_{};
  PathEnds best_ends_;
};

}  // namespace

std::optional<SeparatingPath> shortest_separating_path(
    const Canvas& canvas, const DiskBoundary& boundary, const std::vector<Index>& from,
    const std::function<bool(const PathEnds&)>& allowed, const ExecutionContext& context) {
  CoverSearch search(canvas, boundary, allowed);
  for (const Index place : from) search.start(place);
  return search.run(context);
}

}  // namespace flipfree::seamless
