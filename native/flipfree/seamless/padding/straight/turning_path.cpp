#include "flipfree/seamless/padding/straight/turning_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "flipfree/base/error.h"

namespace flipfree::seamless {
namespace {

constexpr int kTurningStepsPerCheck = 512;
constexpr double kSheetsPerQuarter = 2.0;
constexpr std::int64_t kNoSheet = -1;
constexpr std::size_t kMostPerSheet = 2;  // ways, times vertices

}  // namespace

void TurningSearch::start(HalfedgeId departure, double turned) {
  cross(departure, departure, kInvalid, turned, 0.0);
}

std::int64_t TurningSearch::key(HalfedgeId arrival, double turned) const {
  const double sheet = std::round(turned / TurnMeter::kQuarter * kSheetsPerQuarter);
  if (!(std::abs(sheet) <= static_cast<double>(sheets_))) return kNoSheet;
  const auto v = static_cast<std::int64_t>(meter_.canvas().mesh().target(arrival));
  return v * (2 * sheets_ + 1) + static_cast<std::int64_t>(sheet) + sheets_;
}

bool TurningSearch::meets_itself(Index way, VertexId v) const {
  const auto nearest = nearest_.find(v);
  if (nearest == nearest_.end()) return false;
  // The parts of the way that are shorter than any to v do not end there.
  for (; way != kInvalid && ways_[at(way)].length >= nearest->second; way = ways_[at(way)].before) {
    if (meter_.canvas().mesh().target(ways_[at(way)].arrival) == v) return true;
  }
  return false;
}

void TurningSearch::cross(HalfedgeId h, HalfedgeId first, Index before, double turned,
                          double length) {
  const Canvas& canvas = meter_.canvas();
  const VertexId v = canvas.mesh().target(h);
  length += meter_.length(h);
  if (canvas.on_curve(v)) arrivals_.push_back({before, h, first, turned, length});
  if (!canvas.is_free(v)) return;
  const double left = left_.empty() ? 0.0 : left_[at(v)];
  if (std::isinf(left)) return;
  const std::int64_t place = key(h, turned);
  if (place == kNoSheet) return;
  const auto [known, is_new] = shortest_.try_emplace(place, length);
  if (!is_new && known->second <= length) return;
  if (meets_itself(before, v)) {
    if (is_new) shortest_.erase(known);
    return;
  }
  known->second = length;
  const auto [nearest, is_first] = nearest_.try_emplace(v, length);
  if (!is_first) nearest->second = std::min(nearest->second, length);
  queue_.emplace_back(length + left, static_cast<Index>(ways_.size()));
  std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
  ways_.push_back({h, first, before, turned, length});
}

void TurningSearch::run(const std::function<void(const Arrival&)>& arrive,
                        const std::function<double()>& limit, std::int64_t* ways_left,
                        const ExecutionContext& context) {
  const Canvas& canvas = meter_.canvas();
  const std::size_t most =
      kMostPerSheet * static_cast<std::size_t>(sheets_) * at(canvas.vertex_count());
  const auto call = [&] {
    for (const Arrival& arrival : arrivals_) arrive(arrival);
    arrivals_.clear();
  };
  call();
  for (int step = 1; !queue_.empty() && queue_.front().first < limit(); ++step) {
    if (step % kTurningStepsPerCheck == 0) context.check();
    if (ways_.size() > most) break;
    if (ways_left != nullptr && --*ways_left < 0) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Curves of the cut that turn little were not found in so many trials.");
    }
    std::pop_heap(queue_.begin(), queue_.end(), std::greater<>());
    const Index index = queue_.back().second;
    queue_.pop_back();
    const Way way = ways_[at(index)];
    if (shortest_.at(key(way.arrival, way.turned)) < way.length) continue;  // a shorter one came
    meter_.for_each_turn(way.arrival, [&](HalfedgeId h, double turn) {
      cross(h, way.first, index, way.turned + turn, way.length);
    });
    call();
  }
}

std::vector<HalfedgeId> TurningSearch::path(const Arrival& arrival) const {
  std::vector<HalfedgeId> path = {arrival.halfedge};
  for (Index way = arrival.way; way != kInvalid; way = ways_[at(way)].before)
    path.push_back(ways_[at(way)].arrival);
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace flipfree::seamless
