#include "flipfree/mesh/files/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "flipfree/base/error.h"

namespace flipfree::mesh {
namespace {

constexpr std::string_view kBlank = " \t\v\f";

// What an error shows of a word, which may be anything.
std::string shown(std::string_view word) {
  if (word.empty()) return "nothing";
  std::string text;
  for (const char c : word.substr(0, 24)) text += c > ' ' && c < '\x7f' ? c : '?';
  return "'" + text + (word.size() > 24 ? "...'" : "'");
}

// from_chars knows no plus sign.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

}  // namespace

void refuse(const std::string& place, const std::string& what, const std::string& cure) {
  throw_invalid(kBadFile, place + ": " + what + ". " + cure + ".");
}

Lines::Lines(std::string_view text) : rest_(text) {
  if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
}

bool Lines::next() {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  line_ = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  ++number_;
  return true;
}

std::string_view next_word(std::string_view& rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
  const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
  rest.remove_prefix(word.size());
  return word;
}

double to_number(std::string_view word, const std::string& place, const char* what) {
  const std::string_view digits = without_plus(word);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range && end == digits.data() + digits.size()) {
    // Nearer to zero than doubles are, or beyond them: 1e-999 has an exponent, and it is negative.
    const std::size_t exponent = digits.find_first_of("eE");
    const bool tiny = exponent == std::string_view::npos
                          ? digits.find_first_not_of("-0.") != 0
                          : digits.substr(exponent + 1).starts_with('-');
    if (tiny) return 0.0;
  } else if (error == std::errc() && end == digits.data() + digits.size() && std::isfinite(value)) {
    return value;
  }
  refuse(place, std::string(what) + " should be a finite number, not " + shown(word));
}

float narrowed(double value, const std::string& place, const char* what) {
  constexpr double kFirstBeyond = 0x1.ffffffp127;  // halfway from the largest to what is next
  if (std::abs(value) >= kFirstBeyond)
    refuse(place, std::string(what) + " is beyond 32-bit numbers", "Scale it down");
  return static_cast<float>(value);
}

float to_float(std::string_view word, const std::string& place, const char* what) {
  return narrowed(to_number(word, place, what), place, what);
}

long long to_integer(std::string_view word, const std::string& place, const char* what) {
  const std::string_view digits = without_plus(word);
  long long value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size())
    refuse(place, std::string(what) + " should be a whole number, not " + shown(word));
  return value;
}

Index count_of(std::size_t elements, const std::string& place) {
  if (elements > static_cast<std::size_t>(std::numeric_limits<Index>::max() / 3))
    refuse(place, "more elements than 32-bit indices can count", "Split the mesh");
  return static_cast<Index>(elements);
}

}  // namespace flipfree::mesh
