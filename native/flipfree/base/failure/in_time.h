// A whole call under the limit of time that its caller set.
#pragma once

#include <string>
#include <typeinfo>
#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"

namespace flipfree {

// work(), with `context` limited to max_seconds; 0: no limit. Throws NotConverged (kTimeLimit) when
// they are over: `what` did not happen, `cure` besides more time. A step of the work that had a
// share of them, and says so, is one of this call, whose number and cure the caller knows. What a
// limit around this one ends is not ours: TimeIsOver goes on.
template <typename Work>
auto in_time(ExecutionContext& context, double max_seconds, const std::string& what,
             const std::string& cure, Work&& work) {
  try {
    const TimeLimit limit(context, limit_of(max_seconds));
    return std::forward<Work>(work)();
  } catch (const TimeIsOver&) {
    if (!(max_seconds > 0.0) || context.time_is_over()) throw;
    throw_out_of_time(what, max_seconds, cure);
  } catch (const NotConverged& failure) {
    if (!(max_seconds > 0.0) || failure.error().code != ErrorCode::kTimeLimit ||
        typeid(failure) != typeid(NotConverged))
      throw;
    throw_out_of_time(what, max_seconds, cure);
  }
}

}  // namespace flipfree
