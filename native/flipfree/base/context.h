// The execution context that every long function takes: cancellation, progress, threads, seed.
//
// One thread solves; any other thread may read the progress and ask to cancel. Both are lock-free,
// so a user interface can poll them as often as it likes. Functions check for cancellation at least
// every 50 ms of work.
#pragma once

#include <atomic>
#include <cstdint>

namespace flipfree {

class ExecutionContext {
 public:
  // Number of threads that solvers may use; results do not depend on it.
  int threads = 2;
  // Seed of everything random; the same seed gives the same bits.
  std::uint64_t seed = 0;

  ExecutionContext() = default;
  // A context for one part of a job, for example one chart of many solved side by side: it has a
  // progress of its own, `threads` of its own, and is cancelled with its parent, which must outlive
  // it.
  ExecutionContext(const ExecutionContext* parent, int part_threads)
      : threads(part_threads), seed(parent->seed), parent_(parent) {}
  ExecutionContext(const ExecutionContext&) = delete;
  ExecutionContext& operator=(const ExecutionContext&) = delete;

  // From any thread: the solver throws Cancelled at its next check.
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const {
    return cancelled_.load(std::memory_order_relaxed) ||
           (parent_ != nullptr && parent_->cancelled());
  }

  // From the solver: throws Cancelled if somebody asked for it.
  void check() const;
  // From the solver: names the stage (a string literal) and its fraction in [0, 1] of the current
  // range, then checks.
  void report(const char* stage, double fraction);

  // From any thread: what was last reported. The fraction never falls.
  const char* stage() const { return stage_.load(std::memory_order_relaxed); }
  double fraction() const { return fraction_.load(std::memory_order_relaxed); }

 private:
  friend class ProgressRange;
  std::atomic<bool> cancelled_{false};
  std::atomic<const char*> stage_{""};
  std::atomic<double> fraction_{0.0};
  double begin_ = 0.0;
  double end_ = 1.0;
  const ExecutionContext* parent_ = nullptr;
};

// While it lives, fractions reported on `context` cover [begin, end] of the range that was current
// before.
class ProgressRange {
 public:
  ProgressRange(ExecutionContext& context, double begin, double end);
  ~ProgressRange();
  ProgressRange(const ProgressRange&) = delete;
  ProgressRange& operator=(const ProgressRange&) = delete;

 private:
  ExecutionContext& context_;
  double begin_;
  double end_;
};

}  // namespace flipfree
