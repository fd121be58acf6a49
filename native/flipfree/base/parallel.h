// Deterministic data parallelism: work is split into chunks by a grain that does not depend on the
// number of threads, so that anything reduced per chunk and combined in chunk order has the same
// bits on one thread as on many.
#pragma once

#include <cstddef>
#include <functional>

#include "flipfree/base/context.h"

namespace flipfree {

// Calls body(begin, end, chunk) for the chunks [0, grain), [grain, 2 grain), ... of [0, count),
// each exactly once, on up to context.threads threads, fewer if the system gives no more; the
// calling thread takes part. The first
// exception (in chunk order) is rethrown after all threads have stopped. Chunks that did not start
// when one threw, or after a cancel, are dropped.
void parallel_for(
    const ExecutionContext& context, std::size_t count, std::size_t grain,
    const std::function<void(std::size_t begin, std::size_t end, std::size_t chunk)>& body);

// Number of chunks that parallel_for makes, for sizing per-chunk results.
constexpr std::size_t chunk_count(std::size_t count, std::size_t grain) {
  return (count + grain - 1) / grain;
}

}  // namespace flipfree
