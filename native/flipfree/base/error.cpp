#include "flipfree/base/error.h"

#include <sstream>

namespace flipfree {

std::string_view describe(ErrorCode code) {
  using Enum = ErrorCode;
  switch (code) { FLIPFREE_ERROR_CODES(FLIPFREE_CASE_OF_TEXT) }
  return "unknown error";
}

std::string rendered(std::string message) {
  std::erase_if(message, [](char c) { return kind_of_mark(c) != ElementKind::kNone; });
  return message;
}

void throw_invalid(ErrorCode code, std::string message, ElementKind kind,
                   std::vector<Index> elements) {
  throw InvalidInput({code, std::move(message), kind, std::move(elements)});
}

void throw_infeasible(ErrorCode code, std::string message, Witness witness, ElementKind kind,
                      std::vector<Index> elements) {
  throw Infeasible({code, std::move(message), kind, std::move(elements), std::move(witness)});
}

void throw_not_converged(ErrorCode code, std::string message, ElementKind kind,
                         std::vector<Index> elements) {
  throw NotConverged({code, std::move(message), kind, std::move(elements)});
}

Error out_of_time(const std::string& what, double max_seconds, const std::string& cure) {
  std::ostringstream message;
  message << what << " in the time allowed";
  if (max_seconds > 0) message << " (max_seconds = " << max_seconds << ")";
  message << ". Allow more time, " << cure << ".";
  return {ErrorCode::kTimeLimit, message.str()};
}

void throw_out_of_time(const std::string& what, double max_seconds, const std::string& cure) {
  throw NotConverged(out_of_time(what, max_seconds, cure));
}

}  // namespace flipfree
