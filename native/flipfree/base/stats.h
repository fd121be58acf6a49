// Named figures that a result carries: seconds per stage, iterations, counts, the rung that was
// used.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace flipfree {
// std::variant of strings or vectors whose copy may fail.

// As std::variant, for std::visit, std::get and std::holds_alternative too; the first alternative
// is default-constructed without an exception. GCC's standard library takes a variant of nothing
// but strings, vectors and small plain types for one that always holds a value; where memory fails
// while the constructor copies such a variant, it destroys a value that was never made. Here the
// value is copied by itself and moved in.
template <typename First, typename... Others>
struct Variant : std::variant<First, Others...> {
  using Base = std::variant<First, Others...>;
  static_assert(std::is_nothrow_default_constructible_v<First>);
  static_assert(std::is_nothrow_move_constructible_v<Base> &&
                std::is_nothrow_move_assignable_v<Base>);

  using Base::Base;
  using Base::operator=;
  Variant() = default;
  Variant(Variant&&) noexcept = default;
  Variant& operator=(Variant&&) noexcept = default;
  ~Variant() = default;

  Variant(const Variant& other) : Base() { *this = other; }
  Variant& operator=(const Variant& other) {
    Base& base = *this;
    std::visit(
        [&base](const auto& value) {
          auto copy = value;
          base = std::move(copy);
        },
        static_cast<const Base&>(other));
    return *this;
  }
};

using StatValue = Variant<double, std::int64_t, std::string>;
using Stats = std::map<std::string, StatValue>;

// Whoever worked on the result had to stop because time was over, or it was accepted.
inline void note_time_limit(Stats& stats) { stats["time_limit_reached"] = std::int64_t{1}; }

// Wall-clock seconds since construction or the last restart.
class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  void restart() { start_ = std::chrono::steady_clock::now(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace flipfree
