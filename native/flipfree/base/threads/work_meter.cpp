#include "flipfree/base/threads/work_meter.h"

#include <time.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace flipfree {
namespace {

constexpr std::size_t kKinds = WorkMeter::kCores.size();

// The last of kCores that is at most `cores`.
std::size_t kind_of(std::size_t cores) {
  std::size_t kind = 0;
  while (kind + 1 < kKinds && WorkMeter::kCores[kind + 1] <= cores) ++kind;
  return kind;
}

}  // namespace

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

WorkMeter::WorkMeter(std::function<double()> clock)
    : clock_(std::move(clock)), stages_{{.name = ""}}, last_(clock_()) {}

void WorkMeter::tick() {
  const double now = clock_();
  const double passed = now - last_;
  for (double& seconds : now_) seconds += passed;
  if (depth_ == 0) {
    Stage& stage = stages_[stage_];
    for (double& seconds : stage.seconds) seconds += passed;
    stage.serial += passed;
  }
  last_ = now;
}

void WorkMeter::enter(const char* stage) {
  if (depth_ > 0 || std::strcmp(stages_[stage_].name, stage) == 0) return;
  tick();
  const auto found = std::find_if(stages_.begin(), stages_.end(), [&](const Stage& known) {
    return std::strcmp(known.name, stage) == 0;
  });
  stage_ = static_cast<std::size_t>(found - stages_.begin());
  if (found == stages_.end()) stages_.push_back({.name = stage});
  last_ = clock_();  // what the meter does itself is nobody's work
}

const std::vector<WorkMeter::Stage>& WorkMeter::stages() {
  tick();
  return stages_;
}

WorkMeter::Loop::Loop(WorkMeter& meter, std::size_t chunks) : meter_(meter) {
  meter_.tick();
  outer_ = meter_.now_;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    dealt_[kind] = std::min({kCores[kind], chunks, kMost});
    busy_[kind].fill(0.0);
    cores_each_[kind] =
        kind + 1 == kKinds ? kind : kind_of(kCores[kind] / std::min(kCores[kind], chunks));
  }
  ++meter_.depth_;
  meter_.now_.fill(0.0);
  meter_.last_ = meter_.clock_();
}

void WorkMeter::Loop::end_chunk() {
  meter_.tick();
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const double seconds = meter_.now_[cores_each_[kind]];
    if (kind + 1 == kKinds) {
      longest_[kind] = std::max(longest_[kind], seconds);
      continue;
    }
    const auto begin = busy_[kind].begin();
    double& first = *std::min_element(begin, begin + static_cast<std::ptrdiff_t>(dealt_[kind]));
    first += seconds;
    longest_[kind] = std::max(longest_[kind], first);
  }
  meter_.now_.fill(0.0);
  meter_.last_ = meter_.clock_();
}

WorkMeter::Loop::~Loop() {
  --meter_.depth_;
  meter_.now_ = outer_;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    meter_.now_[kind] += longest_[kind];
    if (meter_.depth_ == 0) meter_.stages_[meter_.stage_].seconds[kind] += longest_[kind];
  }
  if (meter_.depth_ == 0) ++meter_.stages_[meter_.stage_].loops;
  meter_.last_ = meter_.clock_();
}

}  // namespace flipfree
