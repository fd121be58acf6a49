// Lines, words and numbers of text files, the same in every locale.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"

namespace flipfree::mesh {

// What is said of bytes that are no mesh: they do not have the shape of one.
inline constexpr ErrorCode kBadFile = ErrorCode::kBadShape;

// Throws InvalidInput (kBadFile): "<place>: <what>. <cure>", the cure being to write the file
// again unless another is given.
[[noreturn]] void refuse(const std::string& place, const std::string& what,
                         const std::string& cure = "Write the file again, or with other software");

class Lines {
 public:
  explicit Lines(std::string_view text);
  // Takes the next line, without its end; false past the last.
  bool next();
  std::string_view line() const { return line_; }
  // What stands behind the line.
  std::string_view rest() const { return rest_; }
  std::string place() const { return "Line " + std::to_string(number_); }

 private:
  std::string_view rest_, line_;
  std::size_t number_ = 0;
};

// Takes the next word off `rest`, empty if there is none.
std::string_view next_word(std::string_view& rest);

// A finite number, or an error at that place. `what` says in it what should be there.
double to_number(std::string_view word, const std::string& place, const char* what);
// The nearest 32-bit number, an error at that place if there is none.
float narrowed(double value, const std::string& place, const char* what);
float to_float(std::string_view word, const std::string& place, const char* what);
long long to_integer(std::string_view word, const std::string& place, const char* what);

// Number of elements so far as an index; an error at that place beyond what corner ids can count.
Index count_of(std::size_t elements, const std::string& place);

}  // namespace flipfree::mesh
