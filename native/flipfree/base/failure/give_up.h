// Ways and steps that may be given up: because they fail, or because their time is over.
#pragma once

#include <optional>
#include <type_traits>
#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/base/failure/outcome.h"

namespace flipfree {

// attempt() of a part of a problem, or of one way to solve it, whose Infeasible proves nothing for
// the whole: it is an error like the others.
template <typename Step>
auto attempt_part(Step&& step) -> Outcome<std::invoke_result_t<Step>> {
  try {
    return attempt(std::forward<Step>(step));
  } catch (const Infeasible& failure) {
    return failure.error();
  }
}

// The error of the NotConverged that a step without a value ends in; nothing if it comes to its
// end.
template <typename Step>
std::optional<Error> failure_of(Step&& step) {
  const Outcome<bool> outcome = attempt([&] {
    std::forward<Step>(step)();
    return true;
  });
  return outcome ? std::nullopt : std::optional<Error>(outcome.error());
}

// Runs `work`; false if time was over before it ended.
template <typename Work>
bool ended_in_time(Work&& work) {
  try {
    std::forward<Work>(work)();
    return true;
  } catch (const TimeIsOver&) {
    return false;
  }
}

// The same for `way` and its share of the time; TimeIsOver if all of it is over.
template <typename Way>
bool ended_in_share(ExecutionContext& context, Way&& way) {
  if (ended_in_time(std::forward<Way>(way))) return true;
  context.check();
  return false;
}

}  // namespace flipfree
