#include "flipfree/base/context.h"

#include <algorithm>

#include "flipfree/base/error.h"

namespace flipfree {

void ExecutionContext::check() const {
  if (cancelled()) throw Cancelled();
}

void ExecutionContext::report(const char* stage, double fraction) {
  const double mapped = begin_ + (end_ - begin_) * std::clamp(fraction, 0.0, 1.0);
  stage_.store(stage, std::memory_order_relaxed);
  // Parts solved side by side may report at once: the largest value wins.
  double shown = fraction_.load(std::memory_order_relaxed);
  while (mapped > shown &&
         !fraction_.compare_exchange_weak(shown, mapped, std::memory_order_relaxed)) {
  }
  check();
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

}  // namespace flipfree
