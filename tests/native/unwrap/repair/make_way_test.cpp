#include "flipfree/unwrap/repair/settle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "flipfree/base/stats.h"
#include "flipfree/certify/overlap.h"

namespace flipfree::unwrap::make_way_test {
namespace {

// Squares of two triangles each.
struct Squares {
  Triangles faces = (Triangles(2, 3) << 0, 1, 2, 0, 2, 3).finished();
  Triangles more = (Triangles(4, 3) << 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4).finished();
  std::vector<Points2> uv;
  std::vector<Points2> before;
  std::vector<StandingChart> charts;

  static Points2 square(double x, double y, double size) {
    Points2 corners(5, 2);
    corners << 0, 0, 1, 0, 1, 1, 0, 1, 0.5, 0.5;
    corners *= size;
    corners.rowwise() += Eigen::RowVector2d(x, y);
    return corners;
  }
  void add(double x, double y, double size, bool may_move = true, bool of_more = false) {
    uv.push_back(square(x, y, size));
    charts.push_back({of_more ? &more : &faces, nullptr, nullptr, may_move});
  }
  std::vector<char> moves(bool all_apart = true) {
    before.resize(uv.size());
    for (std::size_t c = 0; c < uv.size(); ++c) {
      charts[c].uv = &uv[c];
      if (before[c].rows() > 0) charts[c].before = &before[c];
    }
    return make_way(charts, all_apart, ExecutionContext());
  }
};

bool overlap(const Squares& squares, std::size_t a, const Points2& uv_a, std::size_t b,
             const Points2& uv_b) {
  mesh::Components two;
  two.count = 2;
  std::vector<Eigen::RowVector2d> corners;
  const auto append = [&](const Triangles& faces, const Points2& uv, Index island) {
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) corners.emplace_back(uv.row(faces(f, k)));
      two.of_face.push_back(island);
    }
  };
  append(*squares.charts[a].faces, uv_a, 0);
  append(*squares.charts[b].faces, uv_b, 1);
  Points2 all(static_cast<Eigen::Index>(corners.size()), 2);
  for (std::size_t i = 0; i < corners.size(); ++i)
    all.row(static_cast<Eigen::Index>(i)) = corners[i];
  return certify::island_overlaps(two, all).pairs > 0;
}

// What make_way() promises, one after the other.
std::vector<char> one_by_one(const Squares& squares, bool all_apart) {
  std::vector<std::size_t> order(squares.charts.size());
  for (std::size_t c = 0; c < order.size(); ++c) order[c] = c;
  const auto rank = [&](std::size_t c) {
    return std::pair(squares.charts[c].may_move, -squares.charts[c].faces->rows());
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
  std::vector<char> moves(order.size(), 0);
  const auto then = [&](std::size_t c) -> const Points2& {
    return squares.before[c].rows() > 0 ? squares.before[c] : squares.uv[c];
  };
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t c = order[i];
    for (std::size_t k = 0; k < i && squares.charts[c].may_move; ++k) {
      const std::size_t other = order[k];
      if (moves[other] != 0) continue;
      if (!overlap(squares, c, squares.uv[c], other, squares.uv[other])) continue;
      const bool did =
          squares.before[c].rows() > 0 && overlap(squares, c, then(c), other, then(other));
      moves[c] |= all_apart || !did;
    }
  }
  return moves;
}

TEST(MakeWay, the_smaller_of_two_moves_and_what_touches_stays) {
  Squares squares;
  squares.add(0, 0, 1);
  squares.add(0.5, 0.5, 1, true, true);
  squares.add(1.5, 0.5, 1);
  EXPECT_EQ(squares.moves(), (std::vector<char>{1, 0, 0}));
}

TEST(MakeWay, what_may_not_move_stays_even_if_it_is_smaller) {
  Squares squares;
  squares.add(0, 0, 1, true, true);
  squares.add(0.25, 0.25, 0.5, false);
  squares.add(0.3, 0.3, 0.5, false);
  EXPECT_EQ(squares.moves(), (std::vector<char>{1, 0, 0}));
}

TEST(MakeWay, small_and_large_ones_find_each_other_wherever_they_are) {
  for (const double far : {0.0, -1e6, 3e15}) {
    Squares squares;
    squares.add(far, 0, 4096, true, true);
    for (int i = 0; i < 40; ++i) squares.add(far + 8192.0 + 2 * i, 5, 1);
    squares.add(far + 4000, 4000, 2);
    squares.add(far + 5000, 4000, 2);
    std::vector<char> wanted(43, 0);
    wanted[41] = 1;
    EXPECT_EQ(squares.moves(), wanted) << far;
  }
}

TEST(MakeWay, what_lay_there_before_may_stay_unless_all_are_to_be_apart) {
  Squares squares;
  squares.add(0, 0, 1);
  squares.add(0.5, 0.5, 1);
  squares.before = {Points2(), Squares::square(0.25, 0.25, 1)};
  EXPECT_EQ(squares.moves(false), (std::vector<char>{0, 0}));
  EXPECT_EQ(squares.moves(true), (std::vector<char>{0, 1}));
  squares.before[1] = Squares::square(7, 0.25, 1);
  EXPECT_EQ(squares.moves(false), (std::vector<char>{0, 1}));
}

TEST(MakeWay, random_squares_as_one_by_one) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 200; ++round) {
    Squares squares;
    const int count = 1 + static_cast<int>(random() % 40);
    for (int i = 0; i < count; ++i) {
      squares.add(8.0 * unit(random) - 4.0, 8.0 * unit(random) - 4.0,
                  std::exp2(-6.0 * unit(random) + 2.0), random() % 4 != 0, random() % 2 != 0);
      squares.before.emplace_back();
      if (random() % 2 != 0)
        squares.before.back() = Squares::square(8.0 * unit(random) - 4.0, 0.0, 2.0);
    }
    for (const bool all_apart : {false, true}) {
      const std::vector<char> moves = squares.moves(all_apart);
      EXPECT_EQ(moves, one_by_one(squares, all_apart)) << round;
    }
  }
}

TEST(MakeWay, many_charts_side_by_side_cost_little_more_than_their_number) {
  Squares squares;
  constexpr int kSide = 400;
  for (int i = 0; i < kSide * kSide; ++i) squares.add(2 * (i % kSide), 2 * (i / kSide), 1);
  squares.add(0.5, 0.5, 1);
  const Stopwatch watch;
  const std::vector<char> moves = squares.moves();
  EXPECT_EQ(std::count(moves.begin(), moves.end(), 1), 1);
  EXPECT_LT(watch.seconds(), 5.0);  // all pairs would be 10^10
}

}  // namespace
}  // namespace flipfree::unwrap::make_way_test
