// Every entry point of the library as a call on a small mesh, for tests that let something go wrong
// inside it.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::test {

// A call that came back has said something that is not so.
class WrongResult : public std::logic_error {
  using std::logic_error::logic_error;
};

struct Call {
  std::string name;
  // Runs with a limit of time (seconds; 0: none). Returns the bytes of the result but for its
  // times; throws what the call throws, and WrongResult if the result does not keep its promise.
  std::function<std::string(ExecutionContext& context, double max_seconds)> run;
  // Blocks that CGAL's triangulations lose when memory runs out: Compact_container allocates a
  // block, then room for its address, and drops the block if there is none.
  int may_lose_blocks = 0;
};

// All calls: maps (unwrap, improve, pack, embed, match, certify), then the conformal and the
// seamless ones.
std::vector<Call> all_calls();
std::vector<Call> map_calls();
std::vector<Call> conformal_calls();
std::vector<Call> seamless_calls();

// What the call returns on so many threads, without a limit of time.
std::string result_of(const Call& call, int threads);

// The name of a call as GoogleTest takes it: letters, digits and underscores.
std::string identifier(const std::string& name);

// Bytes of a certified map; WrongResult unless its certificate, and a second one measured anew, say
// that it is valid.
std::string bytes_of_valid(const certify::Parametrization& map, const mesh::Surface& input);

template <typename T>
void append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}
template <typename T>
void append(std::string& bytes, const std::vector<T>& values) {
  append(bytes, values.data(), values.size());
}
template <typename Matrix>
void append_matrix(std::string& bytes, const Matrix& values) {
  append(bytes, values.data(), static_cast<std::size_t>(values.size()));
}

}  // namespace flipfree::test
