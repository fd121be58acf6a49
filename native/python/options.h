// Options as Python gives them, {name: value}, read into the solver's structs.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/intrinsic/loops.h"

namespace flipfree::python {

// Reads a dict member by member. A member that the dict does not have keeps the solver's default.
class OptionReader {
 public:
  explicit OptionReader(const pybind11::dict& given);

  void operator()(const char* name, bool& member);
  void operator()(const char* name, int& member);
  void operator()(const char* name, double& member);
  // From numpy arrays: ids or numbers, rows of pairs, of points.
  void operator()(const char* name, std::vector<Index>& member);
  void operator()(const char* name, std::vector<double>& member);
  void operator()(const char* name, IndexPairs& member);
  void operator()(const char* name, Points2& member);
  // From (corners, uv).
  void operator()(const char* name, std::vector<certify::CornerPin>& member);
  // From [(half-edges, quarter turns)], or None.
  void operator()(const char* name, std::optional<std::vector<intrinsic::LoopTurn>>& member);

  template <typename Value>
  void operator()(const char* name, std::optional<Value>& member) {
    if (has(name)) (*this)(name, member.emplace());
  }

  // One of `choices`, by its name. Throws InvalidInput if it is none.
  template <typename Value>
  void choice(const char* name, Value& member,
              std::initializer_list<std::pair<std::string_view, Value>> choices) {
    if (!has(name)) return;
    const std::string_view given = chosen(name);
    for (const auto& [word, value] : choices) {
      if (word == given) {
        member = value;
        return;
      }
    }
    refuse(name, given);
  }

  bool has(const char* name) const { return given_.contains(name); }
  // The value as it is, which counts as read; a null handle if there is none.
  pybind11::object value(const char* name);

  // Throws InvalidInput if an option was not read, which is none of the struct's.
  void end() const;

 private:
  std::string_view chosen(const char* name);
  [[noreturn]] static void refuse(const char* name, std::string_view word);

  pybind11::dict given_;
  std::size_t read_ = 0;
};

}  // namespace flipfree::python
