// Failure as a value, and errors in terms of what the caller gave.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <variant>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"

namespace flipfree {

// Failure as a value, for steps inside a stage that may well end without a result: whoever asks for
// one has another way, and is no place for an exception handler.

// A T, or why there is none.
template <typename T>
class Outcome {
 public:
  Outcome(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Outcome(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  // Precondition of the first three: there is a value; of error(): there is none.
  T& operator*() { return std::get<0>(state_); }
  const T& operator*() const { return std::get<0>(state_); }
  T* operator->() { return &std::get<0>(state_); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

// What step() returns, or the error of the NotConverged that it ends in. All else goes on, as it is
// no matter of this step: Cancelled, TimeIsOver, InvalidInput, Infeasible and bugs.
template <typename Step>
auto attempt(Step&& step) -> Outcome<std::invoke_result_t<Step>> {
  try {
    return std::forward<Step>(step)();
  } catch (const NotConverged& failure) {
    return failure.error();
  }
}

// Ways and steps that may be given up: because they fail, or because their time is over.

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
bool ended_in_time(ExecutionContext& context, Way&& way) {
  if (ended_in_time(std::forward<Way>(way))) return true;
  context.check();
  return false;
}

// Runs `work`, which makes a result better that is one as it stands: the best so far is kept where
// time is over ("time_limit_reached") or it ends in NotConverged ("optimise_failure").
template <typename Work>
void improve_in_time(const ExecutionContext& context, Stats& stats, Work&& work) {
  const bool in_time = ended_in_time([&] {
    try {
      std::forward<Work>(work)();
    } catch (const NotConverged& failure) {
      stats["optimise_failure"] = failure.error().message;
    }
  });
  if (!in_time || context.time_is_over()) note_time_limit(stats);
}

// A whole call under the limit of time that its caller set.

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

// Errors in terms of what the caller gave, where a stage works on something made of it.

// work(), whose InvalidInput, Infeasible and NotConverged carry translate(error). Classes derived
// from these, which carry more than an error, and all others go on as they are.
template <typename Translate, typename Work>
auto with_errors(const Translate& translate, Work&& work) -> decltype(std::forward<Work>(work)()) {
  try {
    return std::forward<Work>(work)();
  } catch (const InvalidInput& e) {
    if (typeid(e) != typeid(InvalidInput)) throw;
    throw InvalidInput(translate(e.error()));
  } catch (const Infeasible& e) {
    if (typeid(e) != typeid(Infeasible)) throw;
    throw Infeasible(translate(e.error()));
  } catch (const NotConverged& e) {
    if (typeid(e) != typeid(NotConverged)) throw;
    throw NotConverged(translate(e.error()));
  }
}

// The elements that an error or a certificate names: how many, and the faces there.

// Enough to select and to look at, few enough to hand on where a whole mesh is at fault.
inline constexpr std::size_t kMostElements = 1000;

inline std::vector<Index> first_elements(const std::vector<Index>& elements) {
  return {elements.begin(),
          elements.begin() + static_cast<std::ptrdiff_t>(std::min(elements.size(), kMostElements))};
}

// The faces that an error names, or those at the vertices that it names; none of other kinds. Cost:
// O(#F) times the vertices.
std::vector<FaceId> faces_at(const Error& error, const Triangles& faces);

// The ids of another mesh for those of the one at hand; kInvalid of elements that it does not have.
struct Renumbering {
  std::function<Index(Index)> vertex;
  std::function<Index(Index)> face;
  std::function<Index(Index)> corner;

  Index operator()(ElementKind kind, Index id) const;
};

// The ids that are marked in a message (error.h); those that the other mesh does not have stay.
std::string renumbered(const std::string& text, const Renumbering& numbers);
// The same with the elements; none if the other mesh does not have one of them.
Error renumbered(Error error, const Renumbering& numbers);
// To a mesh of which all elements have the ids that they have here, and there are others here.
Renumbering known_in(Index vertices, Index faces);

// Checks of our own promises: invariants at stage boundaries, preconditions where a header states
// them. They run in builds with sanitizers and fuzzing (FLIPFREE_DEBUG_CHECKS, set by CMake for all
// sources alike) and are compiled out elsewhere.

#ifdef FLIPFREE_DEBUG_CHECKS
inline constexpr bool kDebugChecks = true;
#else
inline constexpr bool kDebugChecks = false;
#endif

// Throws InternalError, naming the place, unless `broken` is empty.
void require_invariant(const char* place, const std::string& broken);

// find_broken() says what is broken, nothing if all is well; not called where checks are compiled
// out.
template <typename FindBroken>
void debug_check(const char* place, const FindBroken& find_broken) {
  if constexpr (kDebugChecks) require_invariant(place, find_broken());
}

// The same for a condition: holds() or `promise` is broken.
template <typename Holds>
void debug_require(const char* place, const char* promise, const Holds& holds) {
  if constexpr (kDebugChecks) require_invariant(place, holds() ? "" : promise);
}

}  // namespace flipfree
