#include "flipfree/base/context.h"

#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>

#include "flipfree/base/error.h"

namespace flipfree {
namespace {

// Of a process and not of those that it forks.
int process_number() {
#ifdef _WIN32
  return 0;  // nothing forks there
#else
  return ::getpid();
#endif
}

constexpr std::chrono::seconds kPatience{1};

// One call of work_together(), on its caller's stack.
struct Call {
  const std::function<void()>& work;
  std::size_t wanted;      // helpers that may still come
  std::size_t inside = 0;  // helpers that have not left yet
  Call* older = nullptr;
  std::condition_variable left;
};

struct Pool {
  const int process = process_number();
  std::mutex mutex;
  std::condition_variable called;
  Call* newest = nullptr;  // calls that want helpers
  std::size_t threads = 0;
  std::size_t idle = 0;

  void remove(const Call& call) {
    Call** at = &newest;
    while (*at != nullptr && *at != &call) at = &(*at)->older;
    if (*at != nullptr) *at = call.older;
  }
};

// Null: no memory. Never destroyed: helpers may outlive everything that is static.
Pool* pool() {
  static std::atomic<Pool*> current{nullptr};
  Pool* found = current.load(std::memory_order_acquire);
  // A forked child inherits the memory and none of the threads.
  while (found == nullptr || found->process != process_number()) {
    auto* fresh = new (std::nothrow) Pool;
    if (fresh == nullptr) return nullptr;
    if (current.compare_exchange_strong(found, fresh, std::memory_order_acq_rel)) return fresh;
    delete fresh;
  }
  return found;
}

void help(Pool& pool) {
  std::unique_lock lock(pool.mutex);
  for (;;) {
    if (Call* call = pool.newest; call != nullptr) {
      ++call->inside;
      if (--call->wanted == 0) pool.remove(*call);
      lock.unlock();
      call->work();
      lock.lock();
      // Under the lock: the caller may not go, and the signal with it, before it was given.
      if (--call->inside == 0) call->left.notify_all();
      continue;
    }
    ++pool.idle;
    const bool there =
        pool.called.wait_for(lock, kPatience, [&] { return pool.newest != nullptr; });
    --pool.idle;
    if (!there) break;
  }
  --pool.threads;
}

// Precondition: the pool is locked.
void start_threads(Pool& pool, std::size_t helpers) {
  const std::size_t most = std::min(kMostThreads - 1, std::max(helpers, core_count() - 1));
  std::size_t wanted = helpers;
  for (const Call* call = pool.newest; call != nullptr; call = call->older) wanted += call->wanted;
  for (std::size_t free = pool.idle; free < wanted && pool.threads < most; ++free) {
    try {
      std::thread([&pool] { help(pool); }).detach();
    } catch (const std::system_error&) {  // no more are to be had: those there are do the work
      return;
    } catch (const std::bad_alloc&) {
      return;
    }
    ++pool.threads;
  }
}

}  // namespace

std::size_t core_count() {
  static const std::size_t count =
      std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMostThreads);
  return count;
}

void work_together(std::size_t helpers, const std::function<void()>& work) {
  Pool* const found = helpers > 0 ? pool() : nullptr;
  if (found == nullptr) {
    work();
    return;
  }
  Pool& shared = *found;
  Call call{.work = work, .wanted = helpers, .left = {}};
  {
    const std::scoped_lock lock(shared.mutex);
    start_threads(shared, helpers);
    call.older = shared.newest;
    shared.newest = &call;
  }
  for (std::size_t i = 0; i < helpers; ++i) shared.called.notify_one();
  work();
  std::unique_lock lock(shared.mutex);
  shared.remove(call);
  call.left.wait(lock, [&] { return call.inside == 0; });
}

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
