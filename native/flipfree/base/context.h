// The execution context that every long function takes: cancellation, time limits, progress,
// threads, seed.
//
// One thread solves; any other thread may read the progress and ask to cancel. Both are lock-free,
// so a user interface can poll them as often as it likes. Functions check for cancellation, and
// with it for the end of their time, at least every 50 ms of work.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

#include "flipfree/base/types.h"

namespace flipfree {
// Threads that live from one parallel loop to the next: starting them anew costs more than many a
// loop.
//
// The process has one set of them, at most as many as the machine has cores beside the caller's, or
// as many as one call asks for. Loops inside loops and calls from several threads share it, so that
// a busy process has no more threads than it was given. A helper that has found nothing to do for a
// second ends, so that none stays behind when the last call is over. After fork() the child has
// helpers of its own.

// More than this never work at once, whatever was asked for: each needs room of its own in the
// BLAS, which ends the process where it has none left.
constexpr std::size_t kMostThreads = 128;

// The cores that this process may use, at least one, at most kMostThreads.
std::size_t core_count();

// Calls work() on this thread and, meanwhile, up to `helpers` times on others as they are free;
// returns when all of them have left it. There may be none: work() must come to its end
// on this thread alone. Precondition: it does not throw. Allocates nothing but threads.
void work_together(std::size_t helpers, const std::function<void()>& work);

class SharedProgress;

class ExecutionContext {
 public:
  // Number of threads that solvers may use, one for each core unless told otherwise; results do not
  // depend on it. 0 and less: for each core as well.
  int threads = static_cast<int>(core_count());
  // Seed of everything random; the same seed gives the same bits.
  std::uint64_t seed = 0;
  // Seconds on a clock that never goes back; null: the machine's. Tests set their own, before the
  // work begins; it may be asked from several threads.
  std::function<double()> clock;

  ExecutionContext() = default;
  // A context for one part of a job, for example one chart of many solved side by side: it has a
  // progress of its own, `threads` of its own, the time limit and the map in hand that its parent
  // has now, and is cancelled and accepted with its parent, which must outlive it.
  ExecutionContext(const ExecutionContext* parent, int part_threads)
      : threads(part_threads),
        seed(parent->seed),
        clock(parent->clock),
        deadline_(parent->deadline_),
        in_hand_(parent->in_hand_),
        parent_(parent) {}
  // The same for one of several parts whose progress adds up: this one is the share `weight` of the
  // whole. `shared` must outlive it.
  ExecutionContext(const ExecutionContext* parent, int part_threads, SharedProgress* shared,
                   double weight)
      : ExecutionContext(parent, part_threads) {
    shared_ = shared;
    weight_ = weight;
  }
  ExecutionContext(const ExecutionContext&) = delete;
  ExecutionContext& operator=(const ExecutionContext&) = delete;

  // From any thread: the solver throws Cancelled at its next check.
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const {
    return cancelled_.load(std::memory_order_relaxed) ||
           (parent_ != nullptr && parent_->cancelled());
  }

  // From any thread: somebody takes the map as it is. The solver's time is over wherever it has a
  // map that it can return (MapInHand), now or as soon as it has one; elsewhere nothing happens.
  void accept() { accepted_.store(true, std::memory_order_relaxed); }
  bool accepted() const {
    return accepted_.load(std::memory_order_relaxed) || (parent_ != nullptr && parent_->accepted());
  }

  // From the solver: throws Cancelled if somebody asked for it, TimeIsOver if it is.
  void check() const;
  // From the solver: how long the innermost TimeLimit still lasts, not negative; infinite if there
  // is none; zero with a map in hand that is accepted.
  double seconds_left() const;
  bool time_is_over() const {
    return (deadline_ < kForever && now() > deadline_) || (in_hand_ && accepted());
  }
  // From the solver: names the stage (a string literal) and its fraction in [0, 1] of the current
  // range, then checks.
  void report(const char* stage, double fraction);

  // From any thread: what was last reported. The fraction never falls.
  const char* stage() const { return stage_.load(std::memory_order_relaxed); }
  double fraction() const { return fraction_.load(std::memory_order_relaxed); }

 private:
  friend class ProgressRange;
  friend class SharedProgress;
  friend class TimeLimit;
  friend class TimeScope;
  static constexpr double kForever = std::numeric_limits<double>::infinity();

  double now() const;
  void show(const char* stage, double fraction);

  std::atomic<bool> cancelled_{false};
  std::atomic<bool> accepted_{false};
  std::atomic<const char*> stage_{""};
  std::atomic<double> fraction_{0.0};
  double begin_ = 0.0;
  double end_ = 1.0;
  double deadline_ = kForever;
  bool in_hand_ = false;
  const ExecutionContext* parent_ = nullptr;
  SharedProgress* shared_ = nullptr;
  double weight_ = 0.0;
};

// The progress of parts that are solved side by side, added up in the current range of the whole,
// which stays the same meanwhile.
class SharedProgress {
 public:
  // done: share of the whole that the parts do not cover and that is behind.
  SharedProgress(ExecutionContext& whole, double done) : whole_(whole), sum_(done) {}

 private:
  friend class ExecutionContext;
  void add(const char* stage, double share);

  ExecutionContext& whole_;
  std::atomic<double> sum_;
};

// While it lives, fractions reported on `context` cover [begin, end] of the range that was current
// before.
class ProgressRange {
 public:
  ProgressRange(ExecutionContext& context, double begin, double end);
  // The i-th of so many equal parts.
  ProgressRange(ExecutionContext& context, std::size_t i, std::size_t parts)
      : ProgressRange(context, static_cast<double>(i) / static_cast<double>(parts),
                      static_cast<double>(i + 1) / static_cast<double>(parts)) {}
  ~ProgressRange();
  ProgressRange(const ProgressRange&) = delete;
  ProgressRange& operator=(const ProgressRange&) = delete;

 private:
  ExecutionContext& context_;
  double begin_;
  double end_;
};

// What says otherwise, while it lives, when the time of `context` is over. They end in the reverse
// order of their beginnings.
class TimeScope {
 public:
  TimeScope(const TimeScope&) = delete;
  TimeScope& operator=(const TimeScope&) = delete;

 protected:
  explicit TimeScope(ExecutionContext& context)
      : deadline_(context.deadline_),
        in_hand_(context.in_hand_),
        outer_deadline_(context.deadline_),
        outer_in_hand_(context.in_hand_) {}
  ~TimeScope() {
    deadline_ = outer_deadline_;
    in_hand_ = outer_in_hand_;
  }

  double& deadline_;
  bool& in_hand_;

 private:
  double outer_deadline_;
  bool outer_in_hand_;
};

// A deadline: checks throw TimeIsOver from so many seconds after its construction on, or from the
// end of the limit around it on, whichever comes first. Infinite: no limit of its own.
class TimeLimit : TimeScope {
 public:
  TimeLimit(ExecutionContext& context, double seconds);
};

// The map so far is what is returned if time is over: accept() then ends it. Only where TimeIsOver
// costs nothing but distortion, never where it would cost the map.
class MapInHand : TimeScope {
 public:
  explicit MapInHand(ExecutionContext& context) : TimeScope(context) { in_hand_ = true; }
};

// A grace: the limit is so much later, and nothing can be accepted. For work without which what was
// found in time would be lost: without end if it is short, kShort if it is so as a rule, but may
// also take long. Callers wait for a late answer no longer than twice this.
class Grace : TimeScope {
 public:
  static constexpr double kShort = 0.1;

  explicit Grace(ExecutionContext& context,
                 double seconds = std::numeric_limits<double>::infinity())
      : TimeScope(context) {
    deadline_ += seconds;
    in_hand_ = false;
  }
};

// The seconds of a TimeLimit for an option whose zero means that there is none.
inline double limit_of(double max_seconds) {
  return max_seconds > 0.0 ? max_seconds : std::numeric_limits<double>::infinity();
}

// Of so many seconds those for looking for a map of so many faces: what is left over is enough, as
// a rule, to place, store and certify it, which happens after the limit otherwise. At least half.
inline double seconds_to_search(double seconds, Index faces) {
  constexpr double kSecondsPerFace = 4e-6;
  return seconds - std::min(0.5 * seconds, kSecondsPerFace * static_cast<double>(faces));
}

}  // namespace flipfree
