// Deterministic data parallelism: work is split into chunks by a grain that does not depend on the
// number of threads, so that anything reduced per chunk and combined in chunk order has the same
// bits on one thread as on many.
#pragma once

#include <cstddef>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

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

// visit(i, part) for each i of [0, count), a part for each chunk, which begins as `first`. The
// parts in the order of their chunks: the same for any number of threads.
template <typename Part, typename Visit>
std::vector<Part> parts_of(const ExecutionContext& context, std::size_t count, std::size_t grain,
                           const Part& first, const Visit& visit) {
  std::vector<Part> parts(chunk_count(count, grain), first);
  parallel_for(context, count, grain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Part own = first;
    for (std::size_t i = begin; i < end; ++i) visit(i, own);
    parts[chunk] = std::move(own);
  });
  return parts;
}

// Of term(i) for each i of [0, count), with the same bits for any number of threads.
template <typename Term>
double sum_of(const ExecutionContext& context, std::size_t count, std::size_t grain,
              const Term& term) {
  const std::vector<double> parts =
      parts_of(context, count, grain, 0.0, [&](std::size_t i, double& sum) { sum += term(i); });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

// Those i of [0, count) at which where(i), ascending.
template <typename Where>
std::vector<Index> indices_where(const ExecutionContext& context, std::size_t count,
                                 std::size_t grain, const Where& where) {
  const auto parts = parts_of(context, count, grain, std::vector<Index>{},
                              [&](std::size_t i, std::vector<Index>& found) {
                                if (where(i)) found.push_back(static_cast<Index>(i));
                              });
  std::vector<Index> all;
  for (const std::vector<Index>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace flipfree
