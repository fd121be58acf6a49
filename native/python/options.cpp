#include "options.h"

#include <string>

#include "arrays.h"
#include "flipfree/base/error.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

template <typename T>
std::vector<T> to_vector(const py::handle& value) {
  const auto array = value.cast<Array<T>>();
  return {array.data(), array.data() + array.size()};
}

}  // namespace

OptionReader::OptionReader(const py::dict& given) : given_(given) {}

py::object OptionReader::value(const char* name) {
  if (!has(name)) return {};
  ++read_;
  return given_[name];
}

void OptionReader::operator()(const char* name, bool& member) {
  if (const py::object given = value(name)) member = given.cast<bool>();
}
void OptionReader::operator()(const char* name, int& member) {
  if (const py::object given = value(name)) member = given.cast<int>();
}
void OptionReader::operator()(const char* name, double& member) {
  if (const py::object given = value(name)) member = given.cast<double>();
}
void OptionReader::operator()(const char* name, std::vector<Index>& member) {
  if (const py::object given = value(name)) member = to_vector<Index>(given);
}
void OptionReader::operator()(const char* name, std::vector<double>& member) {
  if (const py::object given = value(name)) member = to_vector<double>(given);
}
void OptionReader::operator()(const char* name, IndexPairs& member) {
  if (const py::object given = value(name))
    member = to_matrix<IndexPairs>(given.cast<Array<Index>>(), name);
}
void OptionReader::operator()(const char* name, Points2& member) {
  if (const py::object given = value(name))
    member = to_matrix<Points2>(given.cast<Array<double>>(), name);
}
void OptionReader::operator()(const char* name, std::vector<certify::CornerPin>& member) {
  if (const py::object given = value(name)) {
    const auto [corners, uv] = given.cast<std::pair<Array<Index>, Array<double>>>();
    member = to_corner_pins(corners, uv);
  }
}
void OptionReader::operator()(const char* name,
                              std::optional<std::vector<intrinsic::LoopTurn>>& member) {
  if (const py::object given = value(name)) member = to_loops(given);
}

std::string_view OptionReader::chosen(const char* name) {
  return value(name).cast<std::string_view>();  // the dict holds the word
}

void OptionReader::refuse(const char* name, std::string_view word) {
  throw_invalid(ErrorCode::kBadOption,
                std::string(name) + " cannot be \"" + std::string(word) + "\".");
}

void OptionReader::end() const {
  if (read_ != given_.size())
    throw_invalid(ErrorCode::kBadOption, "There is an option that this call does not have, among " +
                                             py::str(py::list(given_)).cast<std::string>() + ".");
}

}  // namespace flipfree::python
