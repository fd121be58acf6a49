// Threads that live from one parallel loop to the next: starting them anew costs more than many a
// loop.
//
// The process has one set of them, at most as many as the machine has cores beside the caller's, or
// as many as one call asks for. Loops inside loops and calls from several threads share it, so that
// a busy process has no more threads than it was given. A helper that has found nothing to do for a
// second ends, so that none stays behind when the last call is over. After fork() the child has
// helpers of its own.
#pragma once

#include <cstddef>
#include <functional>

namespace flipfree {

// More than this never work at once, whatever was asked for: each needs room of its own in the
// BLAS, which ends the process where it has none left.
constexpr std::size_t kMostThreads = 128;

// The cores that this process may use, at least one, at most kMostThreads.
std::size_t core_count();

// Calls work() on this thread and, meanwhile, up to `helpers` times on others as they are free;
// returns when all of them have left it. There may be none: work() must come to its end
// on this thread alone. Precondition: it does not throw. Allocates nothing but threads.
void work_together(std::size_t helpers, const std::function<void()>& work);

}  // namespace flipfree
