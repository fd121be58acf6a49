#include "flipfree/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>

#include "flipfree/base/context.h"

namespace flipfree {

void parallel_for(const ExecutionContext& context, std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  const std::size_t chunks = chunk_count(count, grain);
  const std::size_t workers = std::min(
      chunks, context.threads > 0 ? static_cast<std::size_t>(context.threads) : core_count());
  if (workers <= 1) {
    for (std::size_t c = 0; c < chunks; ++c) {
      context.check();
      body(c * grain, std::min(count, (c + 1) * grain), c);
    }
    return;
  }

  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::size_t failed_chunk = chunks;
  std::exception_ptr failure;
  const auto work = [&] {
    while (!stop.load(std::memory_order_relaxed)) {
      const std::size_t c = next.fetch_add(1);
      if (c >= chunks) return;
      try {
        context.check();
        body(c * grain, std::min(count, (c + 1) * grain), c);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (c < failed_chunk) {
          failed_chunk = c;
          failure = std::current_exception();
        }
        stop = true;
      }
    }
  };
  work_together(workers - 1, std::ref(work));  // a reference: nothing is allocated
  if (failure) std::rethrow_exception(failure);
}

}  // namespace flipfree
