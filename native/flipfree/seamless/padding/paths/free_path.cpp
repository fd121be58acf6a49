#include "flipfree/seamless/padding/paths/free_path.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <unordered_map>

namespace flipfree::seamless {
namespace {

struct Entry {
  double distance;
  VertexId vertex;
  bool operator>(const Entry& other) const {
    return distance != other.distance ? distance > other.distance : vertex > other.vertex;
  }
};

class Front {
 public:
  Front(const Canvas& canvas, const WayEnd& to) : canvas_(canvas), to_(to) {}

  void cross(HalfedgeId h, double so_far) {
    const double distance = so_far + canvas_.length(h);
    const VertexId v = canvas_.mesh().target(h);
    if (canvas_.is_free(v)) {
      Reached& reached = reached_[v];
      if (distance >= reached.distance) return;
      reached = {distance, h};
      queue_.push({distance, v});
    } else if (distance < best_.distance && is_end(h)) {
      best_ = {distance, h};
    }
  }

  void run(const ExecutionContext& context) {
    for (int step = 1; !queue_.empty() && queue_.top().distance < best_.distance; ++step) {
      if (step % kFreeStepsPerCheck == 0) context.check();
      const Entry entry = queue_.top();
      queue_.pop();
      if (entry.distance > reached_.at(entry.vertex).distance) continue;
      canvas_.mesh().for_each_outgoing(entry.vertex,
                                       [&](HalfedgeId h) { cross(h, entry.distance); });
    }
  }

  std::vector<HalfedgeId> path() const {
    std::vector<HalfedgeId> path;
    HalfedgeId h = best_.arrival;
    while (h != kInvalid) {
      path.push_back(h);
      const auto before = reached_.find(canvas_.mesh().source(h));
      h = before == reached_.end() ? kInvalid : before->second.arrival;
    }
    std::reverse(path.begin(), path.end());
    return path;
  }

 private:
  struct Reached {
    double distance = std::numeric_limits<double>::infinity();
    HalfedgeId arrival = kInvalid;
  };

  bool is_end(HalfedgeId h) const {
    const HalfedgeId back = canvas_.mesh().opposite(h);
    const VertexId v = canvas_.mesh().source(back);
    if (canvas_.on_curve(v)) return to_.sector && to_.sector(canvas_.sector_of(back));
    return to_.cone && to_.cone(v);
  }

  const Canvas& canvas_;
  const WayEnd& to_;
  std::unordered_map<VertexId, Reached> reached_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  Reached best_;
};

}  // namespace

std::vector<HalfedgeId> free_path(const Canvas& canvas, const WayStart& from, const WayEnd& to,
                                  const ExecutionContext& context) {
  context.check();
  Front front(canvas, to);
  // Edges between vertices that are not free are drawn or were split: paths have two edges or more.
  for (const HalfedgeId sector : from.sectors)
    canvas.for_each_inside(sector, [&](HalfedgeId h) { front.cross(h, 0.0); });
  for (const VertexId v : from.vertices) {
    canvas.mesh().for_each_outgoing(v, [&](HalfedgeId h) {
      if (!canvas.is_drawn(h)) front.cross(h, 0.0);
    });
  }
  front.run(context);
  return front.path();
}

}  // namespace flipfree::seamless
