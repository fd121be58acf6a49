#include "flipfree/seamless/padding/paths/separating_path.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <queue>
#include <utility>

#include "flipfree/seamless/padding/paths/free_distances.h"

namespace flipfree::seamless {
namespace {

constexpr int kWaysPerCheck = 1024;
// Looked at per vertex before the search gives up; fewer where there is another way (detours.h).
constexpr std::size_t kMostSeparating = 24;
constexpr std::size_t kMostEnclosing = 6;

// A path from a place to a vertex.
struct Way {
  VertexId vertex;
  Index excess;  // passed so far, and the start's own share
  double distance;
  Index before;        // the way that it continues, or kInvalid
  HalfedgeId arrival;  // its last half-edge
  Index from;          // place where it began
  Index steps;         // half-edges so far
  Index jump;          // some way that this one continues: see continues()
  bool has_gone_on;
};

std::vector<double> distances_to(const Canvas& canvas, const DiskBoundary& boundary,
                                 const std::vector<Index>& to, const ExecutionContext& context) {
  std::vector<HalfedgeId> first;
  for (const Index place : to) {
    canvas.for_each_inside(boundary.halfedges[at(place)],
                           [&](HalfedgeId h) { first.push_back(h); });
  }
  return free_distances(canvas, first, kInvalid, context).distance;
}

// Is a path between these places one that is looked for, with cones of this excess on its left?
using Fits = std::function<bool(const PathEnds& ends, Index enclosed)>;

class CoverSearch {
 public:
  CoverSearch(const Canvas& canvas, const DiskBoundary& boundary, const std::vector<Index>& to,
              const Fits& fits, const ExecutionContext& context)
      : canvas_(canvas),
        boundary_(boundary),
        is_end_(at(boundary.size()), 0),
        fits_(fits),
        crossed_(excess_crossed(canvas, boundary)),
        left_(distances_to(canvas, boundary, to, context)),
        ways_of_(at(canvas.vertex_count())) {
    for (const Index place : to) is_end_[at(place)] = 1;
    along_.push_back(0);
    for (const HalfedgeId h : boundary.halfedges) along_.push_back(along_.back() + crossed_[at(h)]);
  }

  void start(Index place) {
    canvas_.for_each_inside(boundary_.halfedges[at(place)], [&](HalfedgeId h) {
      cross(h, {kInvalid, share(place), 0.0, kInvalid, kInvalid, place, 0, kInvalid, false},
            kInvalid);
    });
  }

  // A* (Hart, Nilsson, Raphael 1968): ways by their length and what is left of them at least.
  std::optional<SeparatingPath> run(std::size_t most_per_vertex, const ExecutionContext& context) {
    const std::size_t most = most_per_vertex * at(canvas_.vertex_count());
    for (int step = 1; !queue_.empty() && queue_.top().first < best_distance_; ++step) {
      if (step % kWaysPerCheck == 0) context.check();
      if (ways_.size() > most) break;
      const Index way = queue_.top().second;
      queue_.pop();
      const Way here = ways_[at(way)];
      const std::vector<Index>& known = ways_of_[at(here.vertex)];
      if (std::find(known.begin(), known.end(), way) == known.end())
        continue;  // a shorter one came
      ways_[at(way)].has_gone_on = true;
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
    ++next.steps;
    next.has_gone_on = false;
    if (canvas_.is_free(next.vertex)) {
      go_on(next);
    } else if (canvas_.on_curve(next.vertex) && next.distance < best_distance_) {
      arrive(next);
    }
  }

  void go_on(const Way& way) {
    if (left_[at(way.vertex)] == FreeDistances::kUnreached) return;
    std::vector<Index>& known = ways_of_[at(way.vertex)];
    // Those that were replaced by shorter ones had not gone on.
    if (std::any_of(known.begin(), known.end(),
                    [&](Index other) { return continues(way.before, other); }))
      return;
    const auto index = static_cast<Index>(ways_.size());
    const auto same = std::find_if(known.begin(), known.end(), [&](Index other) {
      return ways_[at(other)].excess == way.excess;
    });
    if (same != known.end()) {
      if (ways_[at(*same)].distance <= way.distance || ways_[at(*same)].has_gone_on) return;
      *same = index;
    } else {
      known.push_back(index);
    }
    ways_.push_back(way);
    if (way.before == kInvalid) {
      ways_.back().jump = index;
    } else {
      const Way& before = ways_[at(way.before)];
      const Way& jump = ways_[at(before.jump)];
      const bool level = before.steps - jump.steps == jump.steps - ways_[at(jump.jump)].steps;
      ways_.back().jump = level ? jump.jump : way.before;
    }
    queue_.push({way.distance + left_[at(way.vertex)], index});
  }

  // Is `first` this way or one that it continues? By jump pointers (Myers 1983).
  bool continues(Index way, Index first) const {
    if (way == kInvalid) return false;
    const Index steps = ways_[at(first)].steps;
    while (ways_[at(way)].steps > steps) {
      const Index jump = ways_[at(way)].jump;
      way = ways_[at(jump)].steps >= steps ? jump : ways_[at(way)].before;
    }
    return way == first;
  }

  void arrive(const Way& way) {
    const HalfedgeId sector = canvas_.sector_of(canvas_.mesh().opposite(way.arrival));
    const PathEnds ends{way.from, boundary_.place[at(sector)]};
    if (ends.from == ends.to || is_end_[at(ends.to)] == 0) return;
    // Closed along the boundary, counter-clockwise.
    Index enclosed = way.excess - share(ends.from) + along_[at(ends.from)] - along_[at(ends.to)];
    if (ends.from < ends.to) enclosed += along_.back();
    if (!fits_(ends, enclosed)) return;
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
  std::vector<char> is_end_;  // per place
  const Fits& fits_;
  std::vector<Index> crossed_;
  std::vector<double> left_;  // per vertex: length to the nearest of the places `to`, at least
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
    const std::vector<Index>& to, const std::function<bool(const PathEnds&)>& allowed,
    const ExecutionContext& context) {
  const Fits fits = [&](const PathEnds& ends, Index enclosed) {
    const Index corners = left_corners(boundary, ends);
    return corners % 4 != 0 && corners == 4 + enclosed && allowed(ends);
  };
  CoverSearch search(canvas, boundary, to, fits, context);
  for (const Index place : from) search.start(place);
  return search.run(kMostSeparating, context);
}

std::optional<SeparatingPath> shortest_enclosing_path(const Canvas& canvas,
                                                      const DiskBoundary& boundary,
                                                      const PathEnds& ends, Index excess,
                                                      const ExecutionContext& context) {
  const Fits fits = [&](const PathEnds&, Index enclosed) { return enclosed == excess; };
  CoverSearch search(canvas, boundary, {ends.to}, fits, context);
  search.start(ends.from);
  return search.run(kMostEnclosing, context);
}

}  // namespace flipfree::seamless
