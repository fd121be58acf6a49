// Failure as a value, for steps inside a stage that may well end without a result: whoever asks for
// one has another way, and is no place for an exception handler.
#pragma once

#include <type_traits>
#include <utility>
#include <variant>

#include "flipfree/base/error.h"

namespace flipfree {

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

}  // namespace flipfree
