#include "flipfree/base/stats.h"

#include <gtest/gtest.h>

#include <new>
#include <string>
#include <vector>

namespace {

bool memory_fails = false;

template <typename T>
struct Allocator {
  using value_type = T;
  Allocator() = default;
  template <typename U>
  Allocator(const Allocator<U>&) noexcept {}
  T* allocate(std::size_t n) {
    if (memory_fails) throw std::bad_alloc();
    return std::allocator<T>().allocate(n);
  }
  void deallocate(T* p, std::size_t n) noexcept { std::allocator<T>().deallocate(p, n); }
  friend bool operator==(const Allocator&, const Allocator&) { return true; }
};

using Doubles = std::vector<double, Allocator<double>>;
using Ints = std::vector<int, Allocator<int>>;
using Numbers = flipfree::Variant<Doubles, Ints>;

TEST(Variant, IsCopiedMovedAndVisitedAsTheStandardsOwn) {
  Numbers a = Ints{1, 2, 3};
  Numbers b = a;
  EXPECT_EQ(std::get<Ints>(b), (Ints{1, 2, 3}));
  EXPECT_EQ(std::visit([](const auto& v) { return v.size(); }, b), 3U);
  b = Doubles{4.0};
  EXPECT_TRUE(std::holds_alternative<Doubles>(b));
  a = b;
  EXPECT_EQ(std::get<Doubles>(a), Doubles{4.0});
  const Numbers c = std::move(b);
  EXPECT_EQ(c, a);
  const flipfree::Variant<double, std::string> text = std::string(100, 'x');
  EXPECT_EQ(std::get<std::string>(text).size(), 100U);
}

TEST(Variant, ACopyThatMemoryFailsForLeavesBothSidesAsTheyWere) {
  const Numbers source = Ints(100, 7);
  Numbers other = Doubles(3, 1.0);
  Numbers same = Ints(2, 5);
  memory_fails = true;
  EXPECT_THROW(Numbers{source}, std::bad_alloc);
  EXPECT_THROW(other = source, std::bad_alloc);
  EXPECT_THROW(same = source, std::bad_alloc);
  memory_fails = false;
  EXPECT_EQ(std::get<Ints>(source), Ints(100, 7));
  EXPECT_EQ(std::get<Doubles>(other), Doubles(3, 1.0));
  EXPECT_EQ(std::get<Ints>(same), Ints(2, 5));
}

}  // namespace
