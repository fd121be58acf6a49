// Errors in terms of what the caller gave, where a stage works on something made of it.
#pragma once

#include <typeinfo>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree {

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

}  // namespace flipfree
