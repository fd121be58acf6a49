// Paths through free vertices that are judged by their length and by how much they turn: Dijkstra's
// algorithm on sheets, one per vertex and eighth of a turn that the path has turned so far.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/straight/flat_angles.h"

namespace flipfree::seamless {

// What a curve costs: its length, and the square of the quarter turns by which it misses what it
// should turn by, times `quarter`. And what finding it may cost.
struct TurningPrice {
  double quarter = 0.0;
  std::int64_t* ways_left = nullptr;  // that searches look at, all together; null: no end
  double cost(double length, double missed) const {
    const double quarters = missed / TurnMeter::kQuarter;
    return length + quarter * quarters * quarters;
  }
};

// One search from some half-edges on. No path meets itself.
class TurningSearch {
 public:
  struct Way {
    HalfedgeId arrival;  // its last half-edge, to a free vertex
    HalfedgeId first;
    Index before;   // the way that it continues, or kInvalid
    double turned;  // radians to the left, from where straight ahead is zero
    double length;
  };
  // A half-edge by which a way arrives on a curve.
  struct Arrival {
    Index way;  // that it continues
    HalfedgeId halfedge, first;
    double turned, length;
  };

  // `sheets`: on either side. `left`: per vertex, what a way is longer yet at least, which leads
  // the search (A*; Hart, Nilsson, Raphael 1968); infinite where no way leads on. Empty: nothing is
  // known.
  explicit TurningSearch(const TurnMeter& meter, std::vector<double> left = {},
                         std::int64_t sheets = kSheets)
      : meter_(meter), left_(std::move(left)), sheets_(sheets) {}

  // `turned`: where this half-edge heads, to the left of straight ahead. It leaves a curve.
  void start(HalfedgeId departure, double turned);
  // Calls arrive(Arrival) for all ways onto curves, and goes on as long as `limit()` is more than
  // the shortest way that has not been gone on from will be; at most a fixed multiple of #V ways.
  // Cost: O(n log n) for n of them. Throws NotConverged (kIterationLimit) when none of `ways_left`
  // is left; null: no end.
  void run(const std::function<void(const Arrival&)>& arrive, const std::function<double()>& limit,
           std::int64_t* ways_left, const ExecutionContext& context);
  std::vector<HalfedgeId> path(const Arrival& arrival) const;

  // Two turns either way.
  static constexpr std::int64_t kSheets = 16;

 private:
  std::int64_t key(HalfedgeId arrival, double turned) const;
  void cross(HalfedgeId h, HalfedgeId first, Index before, double turned, double length);
  bool meets_itself(Index way, VertexId v) const;

  const TurnMeter& meter_;
  std::vector<double> left_;
  std::int64_t sheets_;
  std::vector<Way> ways_;
  std::unordered_map<std::int64_t, double> shortest_;  // per vertex and sheet
  std::unordered_map<VertexId, double> nearest_;       // per vertex, the shortest way to it
  std::vector<std::pair<double, Index>> queue_;        // a heap by length and what is left
  std::vector<Arrival> arrivals_;                      // not called yet
};

}  // namespace flipfree::seamless
