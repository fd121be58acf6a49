#include "flipfree/base/context.h"

#include <algorithm>
#include <chrono>

#include "flipfree/base/error.h"

namespace flipfree {

void ExecutionContext::check() const {
  if (cancelled()) throw Cancelled();
  if (time_is_over()) throw TimeIsOver();
}

double ExecutionContext::now() const {
  if (clock) return clock();
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double ExecutionContext::seconds_left() const {
  if (in_hand_ && accepted()) return 0.0;
  return deadline_ < kForever ? std::max(0.0, deadline_ - now()) : kForever;
}

void ExecutionContext::report(const char* stage, double fraction) {
  show(stage, fraction);
  check();
}

void ExecutionContext::show(const char* stage, double fraction) {
  const double mapped = begin_ + (end_ - begin_) * std::clamp(fraction, 0.0, 1.0);
  stage_.store(stage, std::memory_order_relaxed);
  // Parts solved side by side may report at once: the largest value wins.
  double shown = fraction_.load(std::memory_order_relaxed);
  while (mapped > shown) {
    if (!fraction_.compare_exchange_weak(shown, mapped, std::memory_order_relaxed)) continue;
    if (shared_ != nullptr) shared_->add(stage, weight_ * (mapped - shown));
    return;
  }
}

void SharedProgress::add(const char* stage, double share) {
  whole_.show(stage, share + sum_.fetch_add(share, std::memory_order_relaxed));
}

ProgressRange::ProgressRange(ExecutionContext& context, double begin, double end)
    : context_(context), begin_(context.begin_), end_(context.end_) {
  const double width = end_ - begin_;
  context_.begin_ = begin_ + width * begin;
  context_.end_ = begin_ + width * end;
}

ProgressRange::~ProgressRange() {
  context_.begin_ = begin_;
  context_.end_ = end_;
}

TimeLimit::TimeLimit(ExecutionContext& context, double seconds) : TimeScope(context) {
  if (seconds < ExecutionContext::kForever)
    deadline_ = std::min(deadline_, context.now() + seconds);
}

}  // namespace flipfree
